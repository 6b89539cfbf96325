"""A sensor that grips target 0 at an instant, for tests of what a target answers."""

from __future__ import annotations

from dataclasses import dataclass

from agents.marco_polo_game.grip_frames import Grip, GripFrame, pack, unpack
from firmware_sim.board import Board


@dataclass(frozen=True)
class GripperSettings:
    number: int
    at_ns: int


class Gripper:
    Settings = GripperSettings

    def __init__(self, board: Board, settings: GripperSettings) -> None:
        self._board = board
        self._port = board.port("grip", self._hear)
        board.at(settings.at_ns, lambda: self._port.send(pack(GripFrame(Grip.GRIPS, 0, settings.number))))

    def _hear(self, data: bytes) -> None:
        frame = unpack(data)
        if frame is not None and frame.kind is Grip.HELD:
            self._board.count(f"held by {frame.sensor}")
