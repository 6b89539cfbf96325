"""A guidance decides where a deployed sensor drives, and when it gives its target up.

The robot program calls
    begin       when the sensor has won the bid for a target
    plan        after `begin`, at `Plan.again_ns`, and whenever `saw` asks for it
    saw         at each sight of that target, and at each detection of it that another sensor tells
    answered    when the sensor's own camera has exposed
    end         when the sensor waits again

A sensor has one guidance for each purpose for which it is deployed, and a guidance serves one deployment at a time. The
robot program keeps the track of the target, detects, bids, captures and records modes; a guidance does none of these.
`longest_stay_ns` is the time limit of both an investigation and an adaptive pursuit.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from agents.marco_polo.c_target import CTarget
from agents.marco_polo.connectivity import ConnectivityGraph
from agents.marco_polo.ground import Ground
from agents.marco_polo.legs import longest_stay_s
from agents.marco_polo.reward import Offer
from agents.marco_polo_game.game_table import Game
from agents.marco_polo_game.track import Seen, Track
from agents.pursuit import Place
from firmware_sim.board import Board


class Plan(NamedTuple):
    """Where the sensor drives from here; `way` is empty for a sensor that stands."""

    way: Sequence[Place]        # waypoints [m]
    again_ns: int               # local time of the next plan, if none is asked for before
    look: bool = False          # request the next exposure of a camera that exposes on request


@dataclass(frozen=True)
class Deck:
    """The parts of the robot program that a guidance uses.

    `graph()` returns the cells that the platform can occupy at present."""

    board: Board
    settings: Any               # the program's
    game: Game
    ground: Ground
    graph: Callable[[], ConnectivityGraph]
    scanning: Callable[[], Collection[str]] = tuple     # the other sensors that told last that they do not pursue


@dataclass(frozen=True)
class Deployment:
    target: int                 # its number
    track: Track                # as the robot keeps it
    offer: Offer                # by which the sensor won
    own: Place                  # where the sensor is [m]


class Guidance(Protocol):
    @property
    def lost(self) -> str:
        """Return why `plan` has returned None, as the cause of the change of mode."""

    @property
    def ends_ns(self) -> int:
        """Return the local time from which on the target cannot be where this guidance expects it."""

    @abstractmethod
    def begin(self, deployment: Deployment, now_ns: int) -> None:
        """Begin a deployment; the robot asks for a plan next."""

    @abstractmethod
    def plan(self, own: Place, now_ns: int) -> Plan | None:
        """Return where to drive from `own` [m]; None to give the target up."""

    def saw(self, seen: Seen) -> bool:
        """Take a sight or a detection that the track has already; return whether a new plan is needed."""
        return False

    def answered(self, exposed_ns: int) -> None:
        """Note that the sensor's camera exposed then; `saw` is told of the target, if it was in view."""
        return

    @abstractmethod
    def end(self) -> None:
        """End the deployment, whatever the reason."""


class MakesGuidance(Protocol):
    def __call__(self, deck: Deck) -> Guidance: ...


def longest_stay_ns(target: CTarget, game: Game) -> int:
    """Return the time after its detection at which a target of the least speed has left its C-target, or the area.

    It has left by then with the probability that `agents.marco_polo.legs.longest_stay_s` assumes, 0.99."""
    parameters = game.parameters
    leg_s = 0.5e-9 * (parameters.turn_least_ns + parameters.turn_greatest_ns)
    return round(longest_stay_s(target.depth_m(game.area), parameters.target_least_mps, leg_s) * 1e9)
