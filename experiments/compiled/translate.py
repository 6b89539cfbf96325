"""Calls mypyc: `python -m experiments.compiled.translate FOLDER`, run in the folder above the packages.

`build` runs it in a process of its own, since mypyc ends the process at an error, and setuptools replaces modules of
Python.
"""

from __future__ import annotations

import sys
import tempfile

from mypyc.build import mypycify
from setuptools import Distribution, Extension

from experiments.compiled.modules import EXTENSIONS, MODULES, file_of

# `make lint` checks types, with stubs that a user need not have.
MYPY = ("--config-file=", "--ignore-missing-imports")


def main() -> None:
    with tempfile.TemporaryDirectory() as temporary:
        modules = mypycify([*MYPY, f"--cache-dir={temporary}/mypy", *map(file_of, MODULES)], opt_level="2",
                           debug_level="0", target_dir=f"{temporary}/c")
        modules += [Extension(name, [source], extra_compile_args=["-O2"]) for name, source in EXTENSIONS.items()]
        building = Distribution({"name": "marconet-compiled", "ext_modules": modules}).get_command_obj("build_ext")
        building.build_lib, building.build_temp = sys.argv[1], f"{temporary}/objects"
        building.ensure_finalized()
        building.run()


if __name__ == "__main__":
    main()
