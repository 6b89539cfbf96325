"""The actuator of a servo, on the motor that it drives: it owns the plant and holds each command until the next."""

from __future__ import annotations

from dataclasses import dataclass

from agents.servo.messages import check_identifier, number_in
from firmware_sim.board import Board


@dataclass(frozen=True)
class MotorSettings:
    command_id: int
    input: str = "u[1]"             # of the plant
    bus: str = "can"

    def __post_init__(self) -> None:
        check_identifier("command_id", self.command_id)


class ServoMotor:
    Settings = MotorSettings

    def __init__(self, board: Board, settings: MotorSettings) -> None:
        self._settings = settings
        board.port(settings.bus, self._heard, listen_only=True)
        self._drive = board.actuators([settings.input]).write
        board.count("commands", 0)
        self._board = board

    def _heard(self, frame: bytes) -> None:
        command = number_in(frame, self._settings.command_id)
        if command is not None:
            self._board.count("commands")
            self._drive([command])
