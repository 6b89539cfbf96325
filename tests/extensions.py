"""Modules of marconet that are written in C, for tests: those that this run uses, or else built for the test."""

from __future__ import annotations

import importlib.util
import subprocess
import sysconfig
from importlib.machinery import ExtensionFileLoader
from pathlib import Path
from types import ModuleType

import pytest

from experiments.compiled.modules import EXTENSIONS, ROOT
from fmus.build import find_compiler

INCLUDE = Path(sysconfig.get_path("include"))
OPTIONS = ("-std=c99", "-D_POSIX_C_SOURCE=200809L", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC")


def extension(name: str, folder: Path) -> ModuleType:
    """Return the module; skips the test where the headers of this Python are missing."""
    if importlib.util.find_spec(name) is not None:
        return importlib.import_module(name)
    if not (INCLUDE / "Python.h").is_file():
        pytest.skip(f"{INCLUDE / 'Python.h'}: no such file: {name} cannot be compiled here")
    short = name.rpartition(".")[2]
    file = folder / f"{short}.so"
    subprocess.run([*find_compiler(), *OPTIONS, f"-I{INCLUDE}", "-o", file, ROOT / EXTENSIONS[name][0]], check=True)
    loader = ExtensionFileLoader(short, str(file))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(short, loader))    # type: ignore[arg-type]
    loader.exec_module(module)
    return module
