"""The controller of a servo: for each measurement that arrives, it sends a command at once.

The reference is a square wave: +1 until half its period, then -1. The command is clipped to the range of the converter.
"""

from __future__ import annotations

from dataclasses import dataclass

from agents.servo.messages import check_identifier, number_in, pack_number
from agents.servo.pd import Pd
from firmware_sim.board import Board


@dataclass(frozen=True)
class ControllerSettings:
    measured_id: int
    command_id: int
    period_ns: int                  # of the measurements, for the derivative
    gain: float = 1.0
    derivative_time_ns: int = 40_000_000
    filter: float = 100.0
    limit: float = 10.0             # [V]
    reference_period_ns: int = 1_000_000_000
    bus: str = "can"

    def __post_init__(self) -> None:
        check_identifier("measured_id", self.measured_id)
        check_identifier("command_id", self.command_id)
        if self.period_ns < 1 or self.derivative_time_ns < 0 or self.reference_period_ns < 2:
            raise ValueError(f"period_ns={self.period_ns}, derivative_time_ns={self.derivative_time_ns}, "
                             f"reference_period_ns={self.reference_period_ns}: expected at least 1, 0 and 2")
        if not (self.filter > 0 and 0 < self.limit <= 1e6):
            raise ValueError(f"filter={self.filter}, limit={self.limit}: expected more than 0, and a limit of at most "
                             "1e6 V")


class ServoController:
    Settings = ControllerSettings

    def __init__(self, board: Board, settings: ControllerSettings) -> None:
        self._board, self._settings = board, settings
        self._law = Pd(settings.gain, settings.derivative_time_ns * 1e-9, settings.filter, settings.period_ns * 1e-9)
        self._bus = board.port(settings.bus, self._heard)
        board.record("reference", "m", self._reference)

    def _reference(self) -> float:
        period_ns = self._settings.reference_period_ns
        return 1.0 if self._board.now_ns % period_ns < period_ns // 2 else -1.0

    def _heard(self, frame: bytes) -> None:
        measured = number_in(frame, self._settings.measured_id)
        if measured is None:
            return
        command = self._law.command(self._reference(), measured)
        limit = self._settings.limit
        self._bus.send(pack_number(self._settings.command_id, max(-limit, min(limit, command))))
