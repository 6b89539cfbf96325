"""Calls mypyc: `python -m experiments.compiled.translate FOLDER`, run in the folder above the packages.

`build` runs it in a process of its own, since mypyc ends the process at an error, and setuptools replaces modules of
Python. mypyc writes one C file for each module, and the compiler runs once for each core of this machine.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from mypyc.build import mypycify
from setuptools import Distribution, Extension
from setuptools.command.build_ext import build_ext

from experiments.compiled.modules import EXTENSIONS, MODULES, file_of

# `make lint` checks types, with stubs that a user need not have.
MYPY = ("--config-file=", "--ignore-missing-imports")


class BuildOnAllCores(build_ext):     # type: ignore[misc]     # setuptools has no types
    """Compiles the C files of an extension at the same time, where setuptools compiles one after another."""

    def build_extensions(self) -> None:
        compile_in_turn = self.compiler.compile

        def compile_all(sources: Sequence[str], *arguments: Any, **options: Any) -> list[str]:
            with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
                objects = pool.map(lambda source: compile_in_turn([source], *arguments, **options), sources)
                return [file for files in objects for file in files]

        self.compiler.compile = compile_all
        super().build_extensions()


def main() -> None:
    with tempfile.TemporaryDirectory() as temporary:
        modules = mypycify([*MYPY, f"--cache-dir={temporary}/mypy", *map(file_of, MODULES)], opt_level="2",
                           debug_level="0", target_dir=f"{temporary}/c", multi_file=True)
        for module in modules:          # robots in C have the same arithmetic: no fused multiply-add
            module.extra_compile_args = [*module.extra_compile_args, "-ffp-contract=off"]
        modules += [Extension(name, files[:1], extra_compile_args=["-O2"]) for name, files in EXTENSIONS.items()]
        building = BuildOnAllCores(Distribution({"name": "marconet-compiled", "ext_modules": modules}))
        building.build_lib, building.build_temp = sys.argv[1], f"{temporary}/objects"
        building.ensure_finalized()
        building.run()


if __name__ == "__main__":
    main()
