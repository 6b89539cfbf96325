"""The registers as gdb numbers them, and the XML that tells gdb so: an ARM core of profile M with a VFP.

The order is that of `Registers` in debug.c; the number of a register is its place.
"""

from __future__ import annotations

import struct
from typing import Final

CORE: Final = (*(f"r{k}" for k in range(13)), "sp", "lr", "pc", "xpsr")
DOUBLES: Final = tuple(f"d{k}" for k in range(16))
SPECIAL: Final = ("msp", "psp", "primask", "basepri", "faultmask", "control")
NAMES: Final = (*CORE, *DOUBLES, "fpscr", *SPECIAL)
BYTES: Final = (*(4 for _ in CORE), *(8 for _ in DOUBLES), *(4 for _ in ("fpscr", *SPECIAL)))
PLACES: Final = tuple(sum(BYTES[:k]) for k in range(len(BYTES)))        # of each register in what `g` answers
LAYOUT: Final = struct.Struct("<17I16Q7I")
PC: Final = NAMES.index("pc")
TYPES: Final = {"sp": "data_ptr", "msp": "data_ptr", "psp": "data_ptr", "pc": "code_ptr"}


def _rows(names: tuple[str, ...], bits: int, kind: str) -> str:
    return "".join(f'<reg name="{name}" bitsize="{bits}" type="{TYPES.get(name, kind)}" regnum="{NAMES.index(name)}"/>'
                   for name in names)


TARGET_XML: Final = (
    '<?xml version="1.0"?><!DOCTYPE target SYSTEM "gdb-target.dtd"><target version="1.0">'
    "<architecture>armv7e-m</architecture>"
    f'<feature name="org.gnu.gdb.arm.m-profile">{_rows(CORE, 32, "uint32")}</feature>'
    f'<feature name="org.gnu.gdb.arm.vfp">{_rows(DOUBLES, 64, "ieee_double")}'
    f'{_rows(("fpscr",), 32, "uint32")}</feature>'
    f'<feature name="org.gnu.gdb.arm.m-system">{_rows(SPECIAL, 32, "uint32")}</feature>'
    "</target>").encode()
