"""A sensor of the Marco Polo game with section 3.4: it looks on request, and tells of a pursued target what it sees.

    waiting, investigating    a look at each exposure, as an idle sensor scans (section 3.2)
    pursuing                  looks by the Adaptive Filter: `adaptive_pursuit`
    any                       sights of a target with k detections are told to all, until it is captured
"""

from __future__ import annotations

from typing import ClassVar

from agents.bidding.bid_frames import Detection as Shared
from agents.marco_polo_game.adaptive_pursuit import AdaptivePursuit
from agents.marco_polo_game.adaptive_settings import AdaptiveSettings
from agents.marco_polo_game.guidance import MakesGuidance
from agents.marco_polo_game.sensor_automaton import GameMode
from agents.marco_polo_game.sensor_robot import SensorRobot
from agents.marco_polo_game.track import Seen, Track
from firmware_sim.board import Board
from netem.media.sensing.sight import LOOK


class AdaptiveRobot(SensorRobot):
    """The program of both UGVs and UAVs."""

    Settings = AdaptiveSettings
    PURSUIT: ClassVar[MakesGuidance] = AdaptivePursuit

    def __init__(self, board: Board, settings: AdaptiveSettings) -> None:
        super().__init__(board, settings)
        board.count("looks", 0)
        board.every(settings.exposure_ns, self._scan, offset_ns=settings.exposure_ns // 2)

    def _scan(self) -> None:
        """Look at the next exposure, unless the pursuit decides on that."""
        if self._mode is not GameMode.PURSUING:
            self._view.send(LOOK)
            self._board.count("looks")

    def _sighted(self, target: int, track: Track, seen: Seen) -> None:
        if track.detections >= self._parameters.detections and not track.captured:
            self._bidding.share(Shared(target, track.detections, seen.at_ns, *seen.place))


class AdaptiveUavRobot(AdaptiveRobot):
    CAPTURES = False


class AdaptiveUgvRobot(AdaptiveRobot):
    CAPTURES = True
