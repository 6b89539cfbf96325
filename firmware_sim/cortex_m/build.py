"""Builds the machine's library for this computer, and images for the machine: each once, in the cache of plants.

    *.c and *.h of this folder + unicorn.h       --the compiler of fmus/build.py--> library
    *.c of a firmware + startup.c + machine.ld   --a compiler for ARM-->            image.elf

The compiler for ARM is $ARM_CC, a GCC for arm-none-eabi, else ziglang if it is installed, else arm-none-eabi-gcc.
Images are built without fused multiply-adds and without a C library; the compiler adds the arithmetic of doubles.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Final

from firmware_sim.cortex_m.errors import ImageError, needs
from fmus.build import OPTIONS, compile_library
from fmus.cache import cache_folder, kept
from fmus.platform_names import library_suffix, platform_fmi3

HERE: Final = Path(__file__).parent
PORT: Final = HERE.parent / "firmware" / "ports" / "cortex_m4"
WARNINGS: Final = ("-Wall", "-Wextra", "-Werror")
LINKER_SCRIPT: Final = "machine.ld"
IMAGE_OPTIONS: Final = ("-std=c99", "-O2", "-g", "-ffp-contract=off", "-ffreestanding", f"-Wl,-T,{LINKER_SCRIPT}",
                        "-Wl,--entry=reset_handler")
ZIG_OPTIONS: Final = ("-target", "thumb-freestanding-eabihf", "-mcpu=cortex_m4+vfp4d16sp", "-fno-sanitize=undefined")
GCC_OPTIONS: Final = ("-mthumb", "-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16", "-nostdlib",
                      "-fno-tree-loop-distribute-patterns",
                      "-Wno-type-limits")           # a firmware may declare no sensors, and no number is below 0
GCC: Final = "arm-none-eabi-gcc"
FOR_GCC: Final = "memory.c"


def build_machine(cache: Path | None = None) -> Path:
    """Return the path of the machine's library; raises MachineMissing without Unicorn, PlantError without compiler."""
    unicorn = _folder("unicorn")
    code = {file.name: file.read_bytes() for file in sorted(HERE.glob("*.[ch]"))}
    headers = sorted((unicorn / "include" / "unicorn").glob("*.h"))
    options = (*OPTIONS, *WARNINGS, platform_fmi3(), *(file.read_text(encoding="utf-8") for file in headers))
    home = kept((cache or cache_folder()) / "cortex_m" / f"machine-{_digest(code, options)}",
                partial(_build_machine, code=code, include=unicorn / "include"))
    return home / f"machine{library_suffix()}"


def _build_machine(draft: Path, code: dict[str, bytes], include: Path) -> None:
    (draft / f"machine{library_suffix()}").write_bytes(
        compile_library(code, "the emulated Cortex-M", [*WARNINGS, f"-I{include}"]))


def unicorn_library() -> Path:
    """Return the path of Unicorn's library, which its wheel holds."""
    folder = _folder("unicorn") / "lib"
    for pattern in ("libunicorn.so*", "libunicorn*.dylib", "unicorn.dll"):
        for file in sorted(folder.glob(pattern)):
            return file
    raise needs("unicorn")


def build_image(name: str, code: Mapping[str, bytes], options: Sequence[str] = (), cache: Path | None = None) -> Path:
    """Return the path of the image NAME.elf built from `code`, C files and headers by name, and the machine's port.

    Raises ImageError for code that does not compile, MachineMissing without a compiler."""
    command, last = arm_compiler()
    files = {**port_files(), **code}
    if last:
        files |= {FOR_GCC: (PORT / FOR_GCC).read_bytes(), "string.h": (PORT / "string.h").read_bytes()}
    words = (*command, *IMAGE_OPTIONS, *WARNINGS, *options)
    key = _digest(files, [*words, *last])
    home = kept((cache or cache_folder()) / "cortex_m" / f"{name}-{key}",
                partial(_build_image, name=name, files=files, words=words, last=last))
    return home / f"{name}.elf"


def arm_compiler() -> tuple[list[str], list[str]]:
    """Return the command of a compiler for the machine, with the options for its processor, and its last words.

    Raises MachineMissing, with a way to install one, if there is none."""
    named = os.environ.get("ARM_CC")
    if not named and importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc", *ZIG_OPTIONS], []
    found = shlex.split(named) if named else [path] if (path := shutil.which(GCC)) else []
    if not found:
        raise needs("ziglang")
    return [*found, *GCC_OPTIONS], ["-lgcc"]


def port_files() -> dict[str, bytes]:
    """Return the files that every image is built with, by name."""
    return {name: (PORT / name).read_bytes() for name in (LINKER_SCRIPT, "machine_registers.h", "startup.c")}


def _build_image(draft: Path, name: str, files: Mapping[str, bytes], words: Sequence[str],
                 last: Sequence[str]) -> None:
    for file, data in files.items():
        (draft / file).write_bytes(data)
    command = [*words, "-fdebug-prefix-map=" + str(draft) + "=.", "-I.", "-o", f"{name}.elf",
               *sorted(file for file in files if file.endswith((".c", ".S"))), *last]
    try:
        done = subprocess.run(command, cwd=draft, capture_output=True, text=True, errors="replace")
    except OSError as error:
        raise ImageError(f"{words[0]}: cannot run the compiler ({error.strerror}): set ARM_CC to a GCC for "
                         "arm-none-eabi, or unset it") from None
    if done.returncode:
        raise ImageError(f"the image {name} does not compile ({'ziglang' if 'ziglang' in words else words[0]}, exit "
                         f"code {done.returncode}):\n{done.stderr.strip()}")
    for file in files:
        (draft / file).unlink()


def _digest(code: Mapping[str, bytes], options: Sequence[str]) -> str:
    key = hashlib.sha256()
    for name, data in sorted(code.items()):
        key.update(f"{name}\0{len(data)}\0".encode() + data)
    key.update("\0".join(options).encode())
    return key.hexdigest()[:16]


def _folder(package: str) -> Path:
    found = importlib.util.find_spec(package)
    if found is None or not found.submodule_search_locations:
        raise needs(package)
    return Path(found.submodule_search_locations[0])
