"""Lets `import` find the compiled modules, if there are any for the present sources."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from importlib.machinery import ModuleSpec
from importlib.util import spec_from_file_location
from pathlib import Path
from types import ModuleType

from experiments.compiled.modules import MODULES, compiled_folder, found_in
from fmus.cache import damage_in, why_untrusted


class CompiledModules:
    def __init__(self, files: Mapping[str, Path]) -> None:
        self._files = files

    def find_spec(self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
                  ) -> ModuleSpec | None:
        file = self._files.get(fullname)
        return None if file is None else spec_from_file_location(fullname, file)


def use_compiled() -> str:
    """Use the compiled modules from now on if possible; returns "compiled", or "interpreted: " and the reason."""
    if os.environ.get("MARCONET_COMPILED") == "0":
        return "interpreted: MARCONET_COMPILED=0"
    if early := [name for name in MODULES if name in sys.modules]:
        return f"interpreted: {early[0]} was imported before experiments"
    try:
        folder = compiled_folder()
        for part in (folder.parent.parent, folder.parent, folder):
            if problem := why_untrusted(part):
                return f"interpreted: {problem}"
        files = found_in(folder)
        if folder.is_dir() and (damage := damage_in(folder)):
            return f"interpreted: {folder}: {damage}: `marconet compile` makes it again"
    except OSError as error:
        return f"interpreted: {error}"
    if not files:
        return "interpreted: `marconet compile` was not called, or a source has changed since"
    sys.meta_path.insert(0, CompiledModules(files))
    return "compiled"
