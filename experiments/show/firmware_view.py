"""A firmware as text: size, functions, and the numbers of what it declares; an image: what it takes of the machine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from experiments.show.console import print_table
from firmware_sim.cortex_m.fault import where
from firmware_sim.cortex_m.image import FLASH, RAM, Image
from firmware_sim.cortex_m.sections import sections, stack_bytes
from firmware_sim.firmware.build import EXPORTS
from firmware_sim.firmware.description import Firmware
from firmware_sim.firmware.ids_header import declared

if TYPE_CHECKING:
    from experiments.show.console import Console


UNWINDING = ".ARM.extab."           # tables of one function each, of which ziglang writes many


def print_firmware(console: Console, firmware: Firmware, folder: Path, library: Path) -> None:
    """Print a folder of firmware; `library` is what it was built into, a shared library or an image."""
    console.print(f"{firmware.name}: {firmware.about}", soft_wrap=True)
    lines = {file.name: len(file.read_text(errors="replace").splitlines()) for file in sorted(folder.glob("*.[ch]"))}
    print_table(console, ["", ""], [
        ("built", f"{library.stat().st_size} bytes, {library}"), ("defines", ", ".join(EXPORTS)),
        ("files", ", ".join(f"{name} ({count} lines)" for name, count in lines.items()))])
    console.print()
    print_table(console, ["in board_ids.h", "number", "about"],
                [(macro, str(number), about) for macro, number, about in declared(firmware)])


def print_image(console: Console, image: Image) -> None:
    """Print what an image takes of the emulated Cortex-M4, section by section."""
    stack = stack_bytes(image)
    print_table(console, ["", ""], [
        ("image", image.name), ("flash", f"{image.flash_bytes} of {len(FLASH)} bytes"),
        ("RAM", f"{image.ram_bytes} of {len(RAM)} bytes"),
        ("stack", f"{stack} of them, " * bool(stack) + f"down from 0x{image.stack_top:08x}"),
        ("entry", where(image, image.entry & ~1))])
    console.print()
    print_table(console, ["section", "in", "address", "bytes"],
                [(row.name, row.memory, f"0x{row.address:08x}", str(row.size)) for row in sections(image)
                 if not row.name.startswith(UNWINDING)])
