"""The key `firmware` of an agent, in place of `program`: a folder of firmware in C, or an .elf file, becomes a class.

Within marconet such an agent's program is "firmware:TARGET:FIRMWARE", which `class_for` turns into the class. The
target of an emulated processor has its clock and cost with it: "cortex_m4 at 100000000 Hz, 1.0".
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from experiments.programs.own_modules import function_for, module_for

PREFIX: Final = "firmware:"
ELF: Final = ".elf"


@dataclass(frozen=True)
class Target:
    """Where a firmware runs; clock and cost are those of an emulated processor."""

    name: str = "host"
    clock_hz: int = 100_000_000
    cycles_per_instruction: float = 0.0     # 0: computing takes no time

    def __str__(self) -> str:
        return self.name if self.name == "host" else f"{self.name} at {self.clock_hz} Hz, {self.cycles_per_instruction}"


def target_of(text: str) -> Target:
    """Return the target whose `str` is `text`."""
    name, _, rest = text.partition(" at ")
    clock, _, cost = rest.partition(" Hz, ")
    return Target(name, int(clock), float(cost)) if rest else Target(name)


def program_of(firmware: str, target: Target) -> str:
    return f"{PREFIX}{target}:{firmware}"


def is_firmware(program: str) -> bool:
    return program.startswith(PREFIX)


def class_for(path: str, folder: Path) -> Any:
    """Return the class that "package.module:Class" names, the function of a blocking program, or a firmware's class.

    The loader has checked that it exists.
    """
    if is_firmware(path):
        return firmware_class_for(path, folder)
    module_name, _, class_name = path.partition(":")
    return getattr(module_for(module_name, folder), class_name)


def firmware_class_for(program: str, folder: Path) -> Any:
    """Return the class of the program "firmware:TARGET:FIRMWARE"; `folder` is that of the scenario.

    Raises FirmwareError for a wrong folder or firmware.toml, or a companion that cannot be imported.
    """
    from firmware_sim.firmware.build import firmware_folder  # late: a robot in Python needs no compiler
    from firmware_sim.firmware.description import TABLE
    from firmware_sim.firmware.errors import FirmwareError

    target, _, firmware = program.removeprefix(PREFIX).partition(":")
    if not firmware.endswith(ELF):
        home = firmware_folder(firmware, folder).resolve()
        return _made(home, (home / TABLE).read_bytes(), target_of(target))
    file = (folder / firmware).resolve()
    if not file.is_file():
        raise FirmwareError(f"{firmware}: no such file: `marconet firmware build FOLDER --target cortex_m4` writes one")
    table = file.parent / TABLE
    return _made(file.parent, table.read_bytes() if table.is_file() else None, target_of(target), file)


@lru_cache(maxsize=64)
def _made(folder: Path, table: bytes | None, target: Target, image: Path | None = None) -> Any:
    """`table`: the content of firmware.toml, so that a changed one makes another class; an `image` may have none."""
    from firmware_sim.firmware.description import TABLE, read_description
    from firmware_sim.firmware.errors import FirmwareError
    from firmware_sim.firmware.program import firmware_class

    if table is None:
        from firmware_sim.cortex_m.elf_program import elf_class

        assert image is not None
        return elf_class(image, target.clock_hz, target.cycles_per_instruction)
    firmware, companion = read_description(folder), None
    if firmware.companion:
        try:
            companion = function_for(firmware.companion, folder)
        except Exception as error:
            raise FirmwareError(f"{folder / TABLE}: companion={firmware.companion!r}: {error}") from error
    if firmware.configuration and not hasattr(companion, "configure"):
        raise FirmwareError(f"{folder / TABLE}: [[configuration]]: expected a `companion` with a static method "
                            "configure(team, name, settings), which computes these values")
    if target.name == "host":
        return firmware_class(firmware, folder, companion)
    from firmware_sim.cortex_m.elf_program import checked_image
    from firmware_sim.cortex_m.firmware import CortexFirmwareProgram, build_for_cortex_m4

    on_chip = type("OnCortexM4", (CortexFirmwareProgram,), {
        "clock_hz": target.clock_hz, "cycles_per_instruction": target.cycles_per_instruction, "image": image,
        "has_execution_time": target.cycles_per_instruction > 0})
    return firmware_class(firmware, folder, companion, on_chip,
                          build_for_cortex_m4 if image is None else lambda folder: checked_image(image))
