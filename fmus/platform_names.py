"""FMI's names for this platform: the folders of an archive that hold binaries, and the suffix of a shared library."""

from __future__ import annotations

import platform
import struct
import sys

_SYSTEM = {"linux": "linux", "darwin": "darwin", "win32": "windows"}
_MACHINE = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64",
            "i386": "x86", "i686": "x86", "x86": "x86", "riscv64": "riscv64"}


def platform_fmi3() -> str:
    """Return the platform tuple of FMI 3.0, as `x86_64-linux`."""
    machine = platform.machine().lower()
    architecture = _MACHINE.get(machine, machine)
    if architecture == "x86_64" and struct.calcsize("P") == 4:
        architecture = "x86"
    return f"{architecture}-{_SYSTEM.get(sys.platform, sys.platform)}"


def platform_fmi2() -> str:
    """Return the platform name of FMI 2.0, as `linux64`, which does not name the architecture."""
    system = {"windows": "win"}.get(_SYSTEM.get(sys.platform, sys.platform), _SYSTEM.get(sys.platform, sys.platform))
    return f"{system}{8 * struct.calcsize('P')}"


def library_suffix() -> str:
    return {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
