"""A sensor of the Marco Polo game with section 3.4: it looks on request, and tells of a pursued target what it sees.

    waiting, investigating    a look at each exposure, as an idle sensor scans (section 3.2)
    pursuing                  looks by the Adaptive Filter: `adaptive_pursuit`
    any                       sights of a target with k detections are told to all, until it is captured; and once
                              that it is out of view, so that the pursuer can tell a lost link from a lost sight
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, Final

from agents.bidding.bid_frames import OUT_OF_VIEW
from agents.bidding.bid_frames import Detection as Shared
from agents.marco_polo_game.adaptive_check import adaptive_problems
from agents.marco_polo_game.adaptive_pursuit import LEFT, LOST_LINK, AdaptivePursuit
from agents.marco_polo_game.adaptive_settings import AdaptiveSettings
from agents.marco_polo_game.guidance import MakesGuidance
from agents.marco_polo_game.sensor_automaton import GameMode
from agents.marco_polo_game.sensor_robot import Purpose, SensorRobot
from agents.marco_polo_game.sensor_settings import SensorSettings
from agents.marco_polo_game.track import Seen, Track
from firmware_sim.board import Board
from firmware_sim.scenario_view import Own, ScenarioView

COUNTERS: Final = ("looks while idle", "looks in pursuit", *(f"pursuits failed: {kind}" for kind in
                   (LEFT, LOST_LINK, "other")), "sights of targets that had left")


class AdaptiveRobot(SensorRobot):
    """The program of both UGVs and UAVs."""

    Settings: ClassVar[type[SensorSettings]] = AdaptiveSettings
    PURSUIT: ClassVar[MakesGuidance] = AdaptivePursuit

    @classmethod
    def check(cls, scenario: ScenarioView, own: Own[Any]) -> Iterator[str]:
        yield from adaptive_problems(scenario, own, captures=cls.CAPTURES)

    def __init__(self, board: Board, settings: AdaptiveSettings) -> None:
        super().__init__(board, settings)
        self._told: set[int] = set()            # targets of which it told a sight last, not that they are out of view
        self._answered_ns = -1                  # newest exposure of its camera
        for counter in COUNTERS:
            board.count(counter, 0)
        board.every(settings.exposure_ns, self._scan, offset_ns=settings.exposure_ns // 2)

    def _scan(self) -> None:
        """Look at the next exposure, unless the pursuit decides on that; tell of targets that are out of view."""
        for target in [*self._told]:
            sight = self._tracks[target].sight
            if sight is not None and sight.at_ns < self._answered_ns:
                self._told.discard(target)
                self._bidding.share(Shared(target, OUT_OF_VIEW, self._answered_ns, *self._mover.place))
        if self._mode is not GameMode.PURSUING:
            self._look("looks while idle")

    def _sighted(self, target: int, track: Track, seen: Seen) -> None:
        if track.captured:
            return
        if (target, Purpose.PURSUIT) in self._attempts:
            self._board.count("sights of targets that had left")
        if track.detections >= self._parameters.detections:
            self._told.add(target)
            self._bidding.share(Shared(target, track.detections, seen.at_ns, *seen.place))

    def _exposed(self, at_ns: int) -> None:
        super()._exposed(at_ns)
        self._answered_ns = at_ns

    def _told_detection(self, origin: str, told: Shared, teller: str) -> None:
        if told.number != OUT_OF_VIEW:
            super()._told_detection(origin, told, teller)
        elif told.target < len(self._tracks):
            self._tracks[told.target].out_of_view_ns[origin] = told.seen_ns

    def _lost(self) -> None:
        if self._mode is GameMode.PURSUING:
            assert self._task is not None
            cause = self._guidance.lost
            kind = next((kind for kind in (LEFT, LOST_LINK) if cause.startswith(kind)), "other")
            self._board.count(f"pursuits failed: {kind}")
            self._board.event("pursuit failed", f"{self._game.targets[self._task.target]}: {cause}")
        super()._lost()


class AdaptiveUavRobot(AdaptiveRobot):
    CAPTURES = False


class AdaptiveUgvRobot(AdaptiveRobot):
    CAPTURES = True
