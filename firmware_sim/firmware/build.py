"""Builds a folder of firmware into a shared library for the host, once: the cache is that of plants.

    *.c *.h of the folder + board_ids.h + include/*.h + host/marconet_host.[ch] --compiler--> NAME.so
                                                 (+ MAVLink's headers, if firmware.toml asks for them)

The compiler and its options are those of plants (`fmus/build.py`): no fused multiply-adds, no link-time surprises.
Warnings are errors.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Final

from firmware_sim.firmware.description import TABLE, Firmware, read_description
from firmware_sim.firmware.errors import FirmwareError
from firmware_sim.firmware.ids_header import ids_header
from firmware_sim.mavlink.c_headers import c_headers
from fmus.build import OPTIONS, compile_library
from fmus.cache import cache_folder, kept
from fmus.errors import PlantError
from fmus.platform_names import library_suffix, platform_fmi3

FIRMWARE: Final = Path(__file__).parent
INCLUDE: Final = FIRMWARE / "include"
HOST: Final = (FIRMWARE / "host" / "marconet_host.c", FIRMWARE / "host" / "marconet_host.h")
WARNINGS: Final = ("-Wall", "-Wextra", "-Werror")
EXPORTS: Final = {"board_start": "int32_t board_start(void)",
                  "board_timer": "void board_timer(uint32_t timer)",
                  "board_receive": "void board_receive(uint32_t port, const uint8_t *data, uint32_t length)"}


def firmware_folder(firmware: str | Path, beside: Path) -> Path:
    """Return the folder of a firmware: a path, from `beside` on, or the name of one that comes with marconet.

    Raises FirmwareError if there is none."""
    own = FIRMWARE / firmware
    folder = own if str(firmware) in own_firmware() and not (beside / firmware / TABLE).is_file() else beside / firmware
    if not (folder / TABLE).is_file():
        raise FirmwareError(f"{firmware}: no firmware there: a firmware is a folder with {TABLE} and C files; those "
                            f"that come with marconet are {', '.join(own_firmware()) or '(none)'}")
    return folder


def own_firmware() -> list[str]:
    return sorted(file.parent.name for file in FIRMWARE.glob(f"*/{TABLE}"))


def build_for_host(folder: Path, cache: Path | None = None) -> Path:
    """Return the path of the firmware's shared library; builds it unless the cache holds it.

    Raises FirmwareError for a wrong table, no compiler, code that does not compile or a missing function."""
    firmware = read_description(folder)
    code, headers = sources(folder, firmware), header_options(folder, firmware, cache)
    key = hashlib.sha256()
    for name, data in sorted(code.items()):
        key.update(f"{name}\0{len(data)}\0".encode() + data)
    key.update("\0".join([*OPTIONS, *WARNINGS, *headers, platform_fmi3()]).encode())
    try:
        home = kept((cache or cache_folder()) / "firmware" / f"{firmware.name}-{key.hexdigest()[:16]}",
                    partial(_build, folder=folder, firmware=firmware, code=code, headers=headers))
    except PlantError as error:
        raise FirmwareError(str(error)) from None
    return home / f"{firmware.name}{library_suffix()}"


def sources(folder: Path, firmware: Firmware) -> dict[str, bytes]:
    """Return the content of every file that the library is built from, by its name."""
    code = {file.name: file.read_bytes() for file in sorted(folder.glob("*.[ch]"))}
    if not any(name.endswith(".c") for name in code):
        raise FirmwareError(f"{folder}: no C file there: it has to define {', '.join(EXPORTS)}")
    ours = {"board_ids.h": ids_header(firmware).encode(),
            **{file.name: file.read_bytes() for file in (*sorted(INCLUDE.glob("*.h")), *HOST)}}
    if taken := [name for name in ours if name in code]:
        raise FirmwareError(f"{folder / taken[0]}: marconet adds a file of this name: rename or remove yours")
    return {**code, **ours}


def header_options(folder: Path, firmware: Firmware, cache: Path | None = None) -> list[str]:
    """Return the compiler's options for the headers that firmware.toml asks for; its messages do not name the cache.

    Raises FirmwareError for an unknown dialect of MAVLink, or a cache that cannot be used."""
    if not firmware.mavlink:
        return []
    try:
        headers = c_headers(firmware.mavlink, cache)
    except ValueError as error:
        raise FirmwareError(f"{folder / TABLE}: mavlink={firmware.mavlink!r}: {error}") from None
    except PlantError as error:
        raise FirmwareError(str(error)) from None
    return ["-isystem", str(headers), f"-fdebug-prefix-map={headers}=mavlink"]


def _build(draft: Path, folder: Path, firmware: Firmware, code: dict[str, bytes], headers: Sequence[str]) -> None:
    linked = ["-Wl,-z,defs"] if sys.platform == "linux" else []
    (draft / f"{firmware.name}{library_suffix()}").write_bytes(compile_library(
        code, f"the firmware {folder}", [*WARNINGS, *headers, *linked], EXPORTS, "its C code"))
