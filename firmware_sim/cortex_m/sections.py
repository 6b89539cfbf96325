"""The sections of an image that take memory of the machine, and how much of it is the stack."""

from __future__ import annotations

import io
from typing import NamedTuple

from firmware_sim.cortex_m.image import FLASH, Image

STACK = ".stack"                    # of machine.ld


class Section(NamedTuple):
    name: str
    address: int
    size: int

    @property
    def memory(self) -> str:
        return "flash" if self.address in FLASH else "RAM"


def sections(image: Image) -> list[Section]:
    """Return the sections by address; none if the file has no table of them."""
    from elftools.elf.constants import SH_FLAGS
    from elftools.elf.elffile import ELFFile

    found = ELFFile(io.BytesIO(image.data)).iter_sections()
    return sorted((Section(section.name, section["sh_addr"], section["sh_size"]) for section in found
                   if section["sh_flags"] & SH_FLAGS.SHF_ALLOC and section["sh_size"]),
                  key=lambda section: section.address)


def stack_bytes(image: Image) -> int:
    """Return the size of the main stack, 0 if no section has its name."""
    return sum(section.size for section in sections(image) if section.name == STACK)
