"""The program of a robot with `firmware = "FILE.elf"`: an image that was built elsewhere, on the emulated Cortex-M4.

With a firmware.toml beside the file the robot is that of a folder of firmware: parameters, sensors and records have the
names of the table, and their numbers. Without it they are numbered by lists, as `CortexMSettings` has them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import MISSING, field, fields, make_dataclass
from pathlib import Path
from typing import Any, ClassVar, Final, get_type_hints

from firmware_sim.board import Board
from firmware_sim.cortex_m.errors import ImageError, MachineMissing
from firmware_sim.cortex_m.image import read_image
from firmware_sim.cortex_m.program import CortexM, CortexMSettings
from firmware_sim.firmware.errors import FirmwareError
from firmware_sim.scenario_view import Own, ScenarioView

OF_THE_AGENT: Final = ("image", "clock_hz", "cycles_per_instruction")       # keys beside `parameters`
_HINTS: Final = get_type_hints(CortexMSettings)
ElfSettings: Final = make_dataclass("ElfSettings", [
    (key.name, _HINTS[key.name], field(default_factory=key.default_factory) if key.default_factory is not MISSING
     else field(default=key.default)) for key in fields(CortexMSettings) if key.name not in OF_THE_AGENT], frozen=True)


class ElfProgram(CortexM):
    """Subclasses have the file, clock and cost."""

    Settings: Any = ElfSettings
    image: ClassVar[Path]
    clock_hz: ClassVar[int]
    cycles_per_instruction: ClassVar[float]

    @classmethod
    def whole(cls, settings: Any) -> CortexMSettings:
        """Return the settings with the keys that the agent has beside `parameters`."""
        return CortexMSettings(image=cls.image, clock_hz=cls.clock_hz,
                               cycles_per_instruction=cls.cycles_per_instruction, **vars(settings))

    @classmethod
    def check(cls, scenario: ScenarioView, own: Own[Any]) -> Iterator[str]:
        try:
            checked_image(cls.image)
        except FirmwareError as error:
            yield f"agents.{next(iter(own))}.firmware: {error}"
        yield from cls.check_ports(own)

    @classmethod
    def debugged_with(cls, settings: Any) -> tuple[Path, ...]:
        return (cls.image,)

    def __init__(self, board: Board, settings: Any) -> None:
        super().__init__(board, self.whole(settings))


def elf_class(file: Path, clock_hz: int, cycles_per_instruction: float) -> type[ElfProgram]:
    return type("OfElfFile", (ElfProgram,), {
        "image": file, "clock_hz": clock_hz, "cycles_per_instruction": cycles_per_instruction,
        "has_execution_time": cycles_per_instruction > 0})


def checked_image(file: Path) -> Path:
    """Return `file`; raises FirmwareError if the machine cannot run it."""
    try:
        read_image(file)
    except (ImageError, MachineMissing) as error:
        raise FirmwareError(str(error)) from None
    return file
