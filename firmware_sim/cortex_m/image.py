"""An image for the machine: an .elf file, read and checked by pyelftools.

What is loaded are the segments of the file, at their physical addresses, all in flash; what lies in RAM the program
fills itself when it starts. The vector table is at address 0: initial stack pointer, reset handler.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from firmware_sim.cortex_m.errors import ImageError, needs

FLASH: Final = range(0x0008_0000)          # as in machine.h
RAM: Final = range(0x2000_0000, 0x2002_0000)
ALLOCATED: Final = 2                                    # SHF_ALLOC
MICROCONTROLLER: Final = ord("M")                       # Tag_CPU_arch_profile
ARCHITECTURES: Final = range(10, 14)                    # Tag_CPU_arch: ARMv7, ARMv6-M, ARMv6S-M, ARMv7E-M


@dataclass(frozen=True)
class Image:
    name: str
    data: bytes                                         # the file
    segments: tuple[tuple[int, bytes], ...]             # address in flash, content
    stack_top: int
    entry: int
    flash_bytes: int
    ram_bytes: int                                      # declared by the file's segments, stack included
    ram_end: int                                        # the address behind them
    stack_low: int                                      # the main stack: [stack_low, stack_top)


def read_image(file: Path) -> Image:
    """Return the image in an .elf file; raises ImageError with the file, the mistake and the rule."""
    try:
        data = file.read_bytes()
    except OSError as error:
        raise ImageError(f"{file}: {error.strerror}: expected an .elf file") from None
    return parse_image(data, str(file))


def parse_image(data: bytes, name: str) -> Image:
    """Return the image in the bytes of an .elf file called `name`; raises ImageError."""
    try:
        from elftools.elf.elffile import ELFFile
    except ModuleNotFoundError:
        raise needs("pyelftools") from None
    try:
        elf = ELFFile(io.BytesIO(data))
        machine, little = elf["e_machine"], elf.little_endian and elf.elfclass == 32
        profile, architecture = (_attribute(elf, name) if machine == "EM_ARM" else None
                                 for name in ("TAG_CPU_ARCH_PROFILE", "TAG_CPU_ARCH"))
        loads = [(segment["p_paddr"], segment["p_vaddr"], segment["p_memsz"], segment.data())
                 for segment in elf.iter_segments() if segment["p_type"] == "PT_LOAD" and segment["p_memsz"]]
        sections = [(section["sh_addr"], section["sh_size"]) for section in elf.iter_sections()
                    if section["sh_flags"] & ALLOCATED and section["sh_size"]]
    except Exception as error:              # pyelftools raises errors of many kinds on damaged files
        raise ImageError(f"{name}: no .elf file that can be read ({type(error).__name__}: {error})") from None
    if machine != "EM_ARM" or not little:
        raise ImageError(f"{name}: is for another processor ({machine}): expected 32 bit ARM, little endian, as "
                         "`ziglang cc -target thumb-freestanding-eabihf -mcpu=cortex_m4+vfp4d16sp` builds it")
    if profile not in (None, MICROCONTROLLER):
        raise ImageError(f"{name}: is for an ARM core of profile {chr(profile)}: expected one of profile M: build it "
                         "with -mcpu=cortex-m4")
    if architecture is not None and architecture not in ARCHITECTURES:
        raise ImageError(f"{name}: is for another ARM core (Tag_CPU_arch {architecture}): expected ARMv7E-M or an "
                         "earlier one of profile M: build it with -mcpu=cortex-m4")
    return _checked(name, data, loads, sections)


def _checked(name: str, data: bytes, loads: list[tuple[int, int, int, bytes]],
             sections: list[tuple[int, int]]) -> Image:
    memory = bytearray(b"\0" * len(FLASH))
    used = ram = ram_end = 0
    segments = []
    for place, address, size, content in loads:
        if content and (place not in FLASH or place + len(content) > FLASH.stop):
            raise ImageError(f"{name}: {len(content)} bytes at 0x{place:08x}: expected all content between "
                             f"0x{FLASH.start:08x} and 0x{FLASH.stop:08x}, the flash: use the linker script machine.ld")
        if not content and (address not in RAM or address + size > RAM.stop):
            raise ImageError(f"{name}: {size} bytes without content at 0x{address:08x}: expected them between "
                             f"0x{RAM.start:08x} and 0x{RAM.stop:08x}, the RAM")
        if content:
            memory[place:place + len(content)] = content
            used = max(used, place + len(content))
            segments.append((place, content))
        if address in RAM:
            ram += size
            ram_end = max(ram_end, min(address + size, RAM.stop))
    stack, entry = (int.from_bytes(memory[k:k + 4], "little") for k in (0, 4))
    if not segments or not any(place <= 0 and place + len(content) >= 8 for place, content in segments):
        raise ImageError(f"{name}: no vector table: expected the initial stack pointer and the reset handler at "
                         "address 0")
    if stack % 8 or not RAM.start < stack <= RAM.stop:
        raise ImageError(f"{name}: the vector table begins with the stack pointer 0x{stack:08x}: expected a multiple "
                         f"of 8 from 0x{RAM.start + 8:08x} to 0x{RAM.stop:08x}, in the RAM")
    if not entry & 1 or entry - 1 not in FLASH or entry - 1 >= used:
        raise ImageError(f"{name}: the reset handler is 0x{entry:08x}: expected an odd address (Thumb) within the "
                         f"{used} bytes of the image")
    return Image(name, data, tuple(segments), stack, entry, used, ram, max(ram_end, stack),
                 _stack_low(stack, sections))


def _stack_low(top: int, sections: list[tuple[int, int]]) -> int:
    """Return the lowest address of the stack: that of its own section, or the end of the section below it."""
    low = RAM.start
    for address, size in sections:
        if address in RAM and address < top:
            low = max(low, address + size if address + size < top else address)
    return low


def _attribute(elf: Any, name: str) -> int | None:
    """Return a number of the file's build attributes, None if they do not have it."""
    section = elf.get_section_by_name(".ARM.attributes")
    if section is None:
        return None
    for subsection in section.iter_subsections():
        for part in subsection.iter_subsubsections():
            for attribute in part.iter_attributes(name):
                value = int(attribute.value)
                return value or None
    return None
