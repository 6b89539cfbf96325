"""A sensor that grips target 0 at an instant, for tests of what a target answers."""

from __future__ import annotations

from dataclasses import dataclass

from agents.marco_polo_game.grip_frames import Grip, Held, pack, unpack
from firmware_sim.board import Board


@dataclass(frozen=True)
class GripperSettings:
    number: int
    at_ns: int
    x_m: float = 5.0            # where it says to be
    y_m: float = 5.0


class Gripper:
    Settings = GripperSettings

    def __init__(self, board: Board, settings: GripperSettings) -> None:
        self._board = board
        self._port = board.port("grip", self._hear)
        board.at(settings.at_ns, lambda: self._port.send(pack(Grip(0, settings.number, settings.x_m, settings.y_m))))

    def _hear(self, data: bytes) -> None:
        frame = unpack(data)
        if isinstance(frame, Held):
            self._board.count(f"held by {frame.sensor}")
