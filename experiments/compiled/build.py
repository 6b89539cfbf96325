"""Compiles the modules into the cache: `marconet compile`.

It needs mypy and setuptools (the extra `compiled`), a C compiler, and the headers of this Python.
"""

from __future__ import annotations

import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
from functools import partial
from pathlib import Path
from typing import Final

from experiments.compiled.modules import ROOT, compiled_folder, found_in
from fmus.build import find_compiler
from fmus.cache import damage_in, kept

NEEDED: Final = ("mypyc", "setuptools")
MOST_ERRORS: Final = 20           # of those that a failed translation tells
MOST_CHARACTERS: Final = 4000     # of an output without one


class CannotCompile(Exception):
    """A tool for compiling is missing or failed. marconet runs without compiled modules, at about half the speed."""

    exit_code = 2


def compile_modules() -> Path:
    """Return the folder with the compiled modules; compiles them if it is missing or incomplete.

    Raises `CannotCompile`.
    """
    folder = compiled_folder()
    if folder.is_dir() and not damage_in(folder) and not found_in(folder):
        shutil.rmtree(folder, ignore_errors=True)
    return kept(folder, partial(_compile, asked_for=folder))


def _compile(draft: Path, asked_for: Path) -> None:
    if missing := [name for name in NEEDED if importlib.util.find_spec(name) is None]:
        raise CannotCompile(f"{', '.join(missing)} missing in this Python: pip install 'mypy>=2.0' setuptools")
    header = Path(sysconfig.get_path("include")) / "Python.h"
    if not header.is_file():
        raise CannotCompile(f"{header}: no such file: install the headers of this Python (Debian: python3-dev)")
    command = [sys.executable, "-m", "experiments.compiled.translate", str(draft)]
    environment = os.environ | {"CC": shlex.join(find_compiler()), "MARCONET_COMPILED": "0"}
    done = subprocess.run(command, cwd=ROOT, env=environment, text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, check=False)
    if done.returncode:
        raise CannotCompile(f"compiling failed (exit code {done.returncode}):\n{_told(done.stdout)}")
    if compiled_folder() != asked_for:
        raise CannotCompile("a source was changed meanwhile: call marconet compile again")


def _told(output: str) -> str:
    """Return the first errors of mypy, mypyc, compiler or linker, or the end of the output if it names none.

    Each comes with the line before it, in which a linker tells what it did not find."""
    lines = output.splitlines()
    errors = [k for k, line in enumerate(lines) if "error:" in line][:MOST_ERRORS]
    return "\n".join(lines[k] for k in sorted({*errors, *(k - 1 for k in errors if k)})) or output[-MOST_CHARACTERS:]
