"""A firmware as text: size, functions, and the numbers of what it declares."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from experiments.show.console import print_table
from firmware_sim.firmware.build import EXPORTS
from firmware_sim.firmware.description import Firmware
from firmware_sim.firmware.ids_header import declared

if TYPE_CHECKING:
    from experiments.show.console import Console


def print_firmware(console: Console, firmware: Firmware, folder: Path, library: Path) -> None:
    console.print(f"{firmware.name}: {firmware.about}", soft_wrap=True)
    lines = {file.name: len(file.read_text(errors="replace").splitlines()) for file in sorted(folder.glob("*.[ch]"))}
    print_table(console, ["", ""], [
        ("library", f"{library.stat().st_size} bytes, {library}"), ("defines", ", ".join(EXPORTS)),
        ("files", ", ".join(f"{name} ({count} lines)" for name, count in lines.items()))])
    console.print()
    print_table(console, ["in board_ids.h", "number", "about"],
                [(macro, str(number), about) for macro, number, about in declared(firmware)])
