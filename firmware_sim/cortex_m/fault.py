"""Says in words why a program on the chip was ended: the cause, the function and line, the registers.

Functions come from the symbols of the .elf file, lines from its debugging tables (DWARF), both read by pyelftools.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any, Final

from firmware_sim.cortex_m.image import RAM, Image
from firmware_sim.cortex_m.machine import Fault

GUARD_BYTES: Final = 4096           # below the RAM: a stack at its beginning overflows into them
CAUSES: Final = (
    "it locked up", "bus fault: read of 0x{address:08x}, where nothing is",
    "bus fault: write to 0x{address:08x}, where nothing is",
    "bus fault: instruction fetch at 0x{address:08x}, where no program is", "write to the flash at 0x{address:08x}",
    "undefined instruction", "0x{address:08x} is no register", "branch to 0x{address:08x}: no Thumb code",
    "return from an exception with 0x{address:08x}, which fits none that is active",
    "stack overflow: no room for an exception's frame at 0x{address:08x}",
    "return from an exception: no frame at 0x{address:08x}", "breakpoint without a debugger",
    "svc where its priority allows none", "no vector table at 0x{address:08x}",
    "unprivileged access to the register 0x{address:08x}", "write to the read-only register 0x{address:08x}",
    "the emulator gave up (error {address} of Unicorn)")
NAMES: Final = (*(f"r{k}" for k in range(13)), "sp", "lr", "pc", "xpsr")


def describe(fault: Fault, image: Image, moment: str = "") -> str:
    """Return the fault in one line; with a `moment` instead where the program is ("last at ...")."""
    registers = ", ".join(f"{name}=0x{value:08x}" for name, value in zip(NAMES, fault.registers, strict=True))
    place = where(image, fault.pc)
    if moment and not fault.cause:
        return f"{moment} at {place}"
    words = CAUSES[fault.cause].format(address=fault.address)
    if fault.cause <= 2 and RAM.start - GUARD_BYTES <= fault.address < RAM.start:
        words = f"stack overflow: access to 0x{fault.address:08x}, below the RAM"
    return f"{words}; at {place}{_caller(image, fault)}; {registers}"


def _caller(image: Image, fault: Fault) -> str:
    """Return who called, as far as the link register tells: in a function that has called others it may not."""
    address = fault.registers[14] & ~1
    function, _ = _place(image, address)
    return "" if function and function == _place(image, fault.pc)[0] else f"; called from {where(image, address)}"


def where(image: Image, address: int) -> str:
    """Return "function, file:line (0x...)", as far as the image tells."""
    function, line = _place(image, address)
    return ", ".join(part for part in (function, line) if part) + f" (0x{address:08x})" if function or line \
        else f"0x{address:08x}"


def _place(image: Image, address: int) -> tuple[str, str]:
    """Return (function, "file:line") of an address, each "" if the image does not tell."""
    from elftools.elf.elffile import ELFFile

    try:
        elf = ELFFile(io.BytesIO(image.data))
        return _function(elf, address), _line(elf, address)
    except Exception:                   # damaged tables say nothing
        return "", ""


def _function(elf: Any, address: int) -> str:
    table = elf.get_section_by_name(".symtab")
    if table is None:
        return ""
    best, name = -1, ""
    for symbol in table.iter_symbols():
        start = symbol["st_value"] & ~1
        if symbol["st_info"]["type"] == "STT_FUNC" and start <= address < start + symbol["st_size"] and start > best:
            best, name = start, symbol.name
    return name


def _line(elf: Any, address: int) -> str:
    if not elf.has_dwarf_info():
        return ""
    dwarf = elf.get_dwarf_info()
    for unit in dwarf.iter_CUs():
        program = dwarf.line_program_for_CU(unit)
        if program is None:
            continue
        for file, line, start, end in _rows(program):
            if line and start <= address < end:         # 0: code that no line has alone
                return f"{_file_name(program, file)}:{line}"
    return ""


def _rows(program: Any) -> Iterator[tuple[int, int, int, int]]:
    """Yield (number of the file, line, first address, end) of each row of a line table."""
    previous = None
    for entry in program.get_entries():
        state = entry.state
        if state is None:
            continue
        if previous is not None and previous.address < state.address:
            yield previous.file, previous.line, previous.address, state.address
        previous = None if state.end_sequence else state


def _file_name(program: Any, number: int) -> str:
    version = program["version"]
    entry = program["file_entry"][number if version >= 5 else number - 1]
    return bytes(entry.name).decode(errors="replace")
