"""Movers: how a sensor of the Marco Polo game drives its platform along places, and what its automaton may claim of it.

    Mover            go(places), stop(), place, coasted_m          what the program of a sensor uses
    MoverSettings    mover(), bounds(), problems()                 what the scenario gives of it, and the checks of it

A platform with inertia does not stand still when its mover is told to stop: it brakes. `Bounds` limits how far it goes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import dist
from typing import NamedTuple, Protocol

from agents.pursuit import Place
from agents.pursuit.law import Area
from firmware_sim.board import Board
from firmware_sim.scenario_view import AgentView, ScenarioView


class Mover(Protocol):
    @property
    def place(self) -> Place:
        """Where the platform is now [m], as its program knows it."""

    @property
    def coasted_m(self) -> float:
        """Distance of the present place from where `stop` was called last, or the run began; 0 while it is to drive."""

    def go(self, places: Sequence[Place]) -> None:
        """Drive from the present place along `places` and stop at the last one, instead of where it was going."""

    def stop(self) -> None:
        """Stop as soon as the platform can."""


class Bounds(NamedTuple):
    """Limits that no platform of a mover exceeds, whatever the program tells it; a sensor's automaton claims them."""

    speed_mps: float            # the place changes by no more than this, along each axis, between two samples
    outside_m: float            # the place is no farther outside the area
    coasts_m: float             # and no farther from where the platform was told to stop


class Platform(NamedTuple):
    """One sensor and the platform that carries it, as a scenario gives them to the checks of a mover."""

    sensor: str
    agent: AgentView            # of the sensor
    carrier: str | None         # node that carries its camera; None: the camera is fixed
    view: str                   # name of the medium of this camera
    speed_mps: float            # greatest speed of the sensor in the game
    barriers: bool              # whether there are obstacles or zones that it has to keep clear of


class MoverSettings(Protocol):
    def mover(self, board: Board, area: Area, speed_mps: float) -> Mover:
        """Return the mover of a platform with the greatest speed `speed_mps`, which keeps to `area`."""

    def bounds(self, speed_mps: float) -> Bounds: ...

    def problems(self, scenario: ScenarioView, platform: Platform) -> Iterator[str]:
        """Yield what keeps the mover from moving this platform, with the remedy."""


@dataclass
class Stop:
    """Where the platform was told to stop; None while it is to drive."""

    at: Place | None

    def coasted_m(self, place: Place) -> float:
        return 0.0 if self.at is None else dist(self.at, place)
