"""Drives an omnidirectional platform at one speed from waypoint to waypoint, on straight legs, and stops at the last.

The platform knows its place. Legs end at timers, to 1 ns; the plant's lag has to be 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil, hypot
from typing import Final

from agents.marco_polo_game.movers import Bounds, Platform, Stop
from agents.marco_polo_game.movers.plants import plant_problems
from agents.pursuit import Place
from agents.pursuit.law import Area
from firmware_sim.board import Board
from firmware_sim.board_timers import Timer
from firmware_sim.scenario_view import ScenarioView

AT_M: Final = 1e-6              # a waypoint nearer than this is reached
INPUTS: Final = ("v_x_cmd", "v_y_cmd", "omega_cmd")


class OmnidirectionalMover:
    def __init__(self, board: Board, speed_mps: float) -> None:
        self._board, self._speed_mps = board, speed_mps
        self._inputs = board.actuators(INPUTS)
        self._pose = board.sensors(["x", "y"], ["m", "m"])
        self._left: list[Place] = []
        self._timer: Timer | None = None
        self._stop = Stop(self.place)

    @property
    def place(self) -> Place:
        x, y = self._pose.read()
        return float(x), float(y)

    @property
    def coasted_m(self) -> float:
        return self._stop.coasted_m(self.place)

    def go(self, places: Sequence[Place]) -> None:
        self._stop.at = None
        self._left = list(places)
        self._next()

    def stop(self) -> None:
        self._left = []
        self._halt()
        self._stop.at = self.place

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


@dataclass(frozen=True)
class OmnidirectionalSettings:
    def mover(self, board: Board, area: Area, speed_mps: float) -> OmnidirectionalMover:
        return OmnidirectionalMover(board, speed_mps)

    def bounds(self, speed_mps: float) -> Bounds:
        return Bounds(speed_mps, AT_M, 0.0)

    def problems(self, scenario: ScenarioView, platform: Platform) -> Iterator[str]:
        """Yield a problem if the sensor has no plant, or one without the inputs that the mover sets."""
        if platform.agent.plant is None:
            yield (f"agents.{platform.sensor}.plant: is missing; a sensor moves one: {{ fmu = \"omnidirectional\" }}, "
                   "or that of another agent, by its parameter drive or flight")
        else:
            yield from plant_problems(platform.sensor, platform.agent.plant, INPUTS, "omnidirectional")
