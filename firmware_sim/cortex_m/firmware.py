"""A firmware behind `marconet_board.h` on the emulated Cortex-M4: the program of a robot with `target = "cortex_m4"`.

    *.c of the folder + board_ids.h + port.c + startup.c --ziglang--> image --Driver--> FirmwareProgram --> Board

All but the loading is that of a firmware on the host (`firmware/program.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Final

from firmware_sim.board import Board
from firmware_sim.cortex_m.build import PORT, build_image
from firmware_sim.cortex_m.driver import Driver
from firmware_sim.cortex_m.errors import ImageError, MachineMissing, ProgramEnds
from firmware_sim.cortex_m.image import read_image
from firmware_sim.cortex_m.machine import Ask
from firmware_sim.cortex_m.new_machine import new_machine
from firmware_sim.cortex_m.program import port_kind, unique_id
from firmware_sim.firmware.board_calls import BoardCalls
from firmware_sim.firmware.build import HOST, INCLUDE, header_options, sources
from firmware_sim.firmware.description import read_description
from firmware_sim.firmware.errors import FirmwareError
from firmware_sim.firmware.program import FirmwareProgram, medium_of
from fmus.errors import PlantError

OF_THE_HOST: Final = frozenset(file.name for file in HOST)
BUDGET: Final = 20_000_000              # instructions without sleeping


def build_for_cortex_m4(folder: Path) -> Path:
    """Return the path of the firmware's image; raises FirmwareError as `build_for_host` does."""
    firmware = read_description(folder)
    code = {name: data for name, data in sources(folder, firmware).items() if name not in OF_THE_HOST}
    code |= {name: (PORT / name).read_bytes() for name in ("port.c", "stdio.h", "string.h")}
    try:
        return build_image(firmware.name, code, header_options(folder, firmware))
    except (ImageError, MachineMissing, PlantError) as error:
        raise FirmwareError(str(error)) from None


class CortexFirmwareProgram(FirmwareProgram):
    """One robot with a firmware on its emulated Cortex-M4; subclasses have `clock_hz` and `cycles_per_instruction`."""

    clock_hz: ClassVar[int] = 100_000_000
    cycles_per_instruction: ClassVar[float] = 0.0
    image: ClassVar[Path | None] = None             # an .elf file that was built elsewhere

    @classmethod
    def debugged_with(cls, settings: Any) -> tuple[Path, ...]:
        """Return the .elf file that a debugger is started with, and folders with its sources."""
        return cls.image or build_for_cortex_m4(cls.folder), cls.folder, PORT, INCLUDE

    def _load(self, parameters: Sequence[Sequence[float]]) -> FirmwareMachine:
        return FirmwareMachine(self.image or build_for_cortex_m4(self.folder), self._board, parameters,
                               [medium_of(port.name, self.firmware, self._board.ports)
                                for port in self.firmware.ports], len(self.firmware.signals),
                               self._calls, self.clock_hz, self.cycles_per_instruction)


class FirmwareMachine:
    """One robot's firmware on an emulated Cortex-M4, with the methods that `Library` has for one on the host."""

    def __init__(self, file: Path, board: Board, parameters: Sequence[Sequence[float]], ports: Sequence[str],
                 signals: int, calls: BoardCalls, clock_hz: int, cycles_per_instruction: float) -> None:
        image = read_image(file)
        self.carry_out = calls.carry_out            # an Ask up to MISTAKE is the host's operation
        self._answer, self.disarm_all, self.timers_armed = calls.answer, calls.disarm_all, calls.timers_armed
        self.signals: Any = [0.0] * (signals + 1)
        self._machine = new_machine(board, image, clock_hz, cycles_per_instruction,
                                    [port_kind(board, name) for name in ports], parameters, unique_id(board.name))
        self.bytes = self._machine.bytes            # of frames and texts
        self._driver = Driver(self._machine, image, board, self, cycles_per_instruction > 0, BUDGET,
                              "a function of the firmware has to return before that")
        self.timer, self.receive, self.close = self._driver.ring, self._driver.receive, self._machine.close

    def start(self) -> int:
        """Start the image; return what `board_start` returned, if it takes no time."""
        try:
            self._driver.start()
        except ProgramEnds as end:
            return end.code - 2**32 if end.code >= 2**31 else end.code
        return 0

    def record(self, signal: int, value: float) -> None:
        self.signals[signal] = value

    def drive(self, stage: int, share: float) -> None:
        raise AssertionError(f"PWM stage {stage} of a machine without any: a firmware calls board_actuate")

    def answer(self, ask: int, number: int, integer: int, real: float) -> float | None:
        return self._answer(ask - Ask.ADJUST_CLOCK + 1, number, integer, real)      # the host's number of the question
