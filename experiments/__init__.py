"""Scenarios in, evidence out. Imported before anything of the emulator, so that its compiled modules can be found."""

from typing import Final

from experiments.compiled.finder import use_compiled

CODE: Final = use_compiled()        # "compiled", or "interpreted: " and why
