"""What guides a sensor while it is deployed: where it drives, and when it gives up.

    begin    the sensor has won the bid for a target        plan    anew at `Plan.again_ns`, and after what it is told
    saw      a sight of that target, or a detection of it by another sensor                  end     it waits again
    answered its camera has exposed

A sensor has one guidance for each purpose for which it is deployed, and the guidance serves one deployment at a time.
The robot program keeps the track of the target, detects, bids, captures, and records modes; a guidance does none of it.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from agents.marco_polo.connectivity import ConnectivityGraph
from agents.marco_polo.ground import Ground
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
    """What a guidance has of its robot; `graph()` returns the cells that the platform can occupy at present."""

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
