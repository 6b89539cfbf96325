"""Drives an omnidirectional platform at one speed from waypoint to waypoint, on straight legs, and stops at the last.

The platform knows its place. Legs end at timers, to 1 ns; the plant's lag has to be 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, hypot

from agents.pursuit import Place
from firmware_sim.board import Board
from firmware_sim.board_timers import Timer

AT_M = 1e-6                     # a waypoint nearer than this is reached


class Mover:
    def __init__(self, board: Board, speed_mps: float) -> None:
        self._board, self._speed_mps = board, speed_mps
        self._inputs = board.actuators(["v_x_cmd", "v_y_cmd", "omega_cmd"])
        self._pose = board.sensors(["x", "y"], ["m", "m"])
        self._left: list[Place] = []
        self._timer: Timer | None = None

    @property
    def place(self) -> Place:
        x, y = self._pose.read()
        return float(x), float(y)

    def go(self, places: Sequence[Place]) -> None:
        """Drive from the present place along `places`, instead of where it was going."""
        self._left = list(places)
        self._next()

    def stop(self) -> None:
        self._left = []
        self._halt()

    def _halt(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._inputs.write([0.0, 0.0, 0.0])

    def _next(self) -> None:
        self._halt()
        x, y = self.place
        while self._left:
            to = self._left[0]
            away = hypot(to[0] - x, to[1] - y)
            if away > AT_M:
                share = self._speed_mps / away
                self._inputs.write([share * (to[0] - x), share * (to[1] - y), 0.0])
                self._timer = self._board.at(self._board.now_ns + ceil(away / self._speed_mps * 1e9), self._next)
                return
            self._left.pop(0)
