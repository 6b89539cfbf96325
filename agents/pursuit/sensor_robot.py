"""A pursuer in a team: it reports its detections to a fusion center over the radio, which assigns it a target.

    idle        stands and scans every T_s; claims a target that enters its escape area until the center answers
    in charge   looks, decides and drives as `PursuerRobot`, also with the others' detections from the center

It applies its own detections at once, whether the radio works or not. The center's charges, ordered by their version,
assign its target; a new target starts a new filter with the robot's own newest detection of it.
Differs from the dissertation, where sensors share all detections at once: here the radio delivers them late or never.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from agents.pursuit import Place
from agents.pursuit.pursuer_check import pursuer_problems
from agents.pursuit.pursuer_robot import PursuerRobot
from agents.pursuit.pursuer_settings import SensorSettings
from agents.pursuit.team_frames import Charges, News, Report, newer, pack_report, team_of, unpack
from firmware_sim.board import Board
from firmware_sim.scenario_view import Own, ScenarioView
from netem.media.sensing.sight import Detection


class SensorRobot(PursuerRobot):
    Settings = SensorSettings

    def __init__(self, board: Board, settings: SensorSettings) -> None:
        super().__init__(board, settings)
        self._team = team_of(board.team)
        self._radio = board.port(settings.radio, self._hear_radio)
        for counter in ("unreadable frames", "detections of others"):
            board.count(counter, 0)
        self._version = -1                              # version of the charges in force
        self._in_view: set[str] | None = None           # targets in view at the last scan; None: it was not idle then
        self._claimed: set[str] = set()
        self._known: set[int] = set()                   # times of the target's detections that the filter has got
        self._sighted: dict[str, tuple[int, Place]] = {}
        self._first = True

    @staticmethod
    def check(scenario: ScenarioView, own: Own[Any]) -> Iterator[str]:
        yield from pursuer_problems(scenario, own)
        sensors = scenario.team.get("sensors", ())
        for name in own:
            if name not in sensors:
                yield f"team.sensors={list(sensors)}: {name} is missing; frames number the sensors by this list"

    # --- scanning

    def _instant(self) -> None:
        self._decide()
        if self._pursuer is None:
            now_ns, step_ns = self._board.now_ns, self._settings.step_ns
            self._look((now_ns // step_ns + 1) * step_ns)

    def _seen(self, seen_ns: int, sights: Sequence[Detection]) -> None:
        places = {sight.name: (sight.x_m, sight.y_m) for sight in sights if sight.name in self._team.targets}
        for target, place in places.items():
            self._sighted[target] = seen_ns, place
        if self._pursuer is None:
            self._scan(places)
        for target, place in places.items():
            self._radio.send(pack_report(self._team, Report(self._board.name, target, target in self._claimed,
                                                            seen_ns, place, self._settings.sigma_m)))
            if target == self._target and seen_ns not in self._known:
                self._known.add(seen_ns)
                self._detected(seen_ns, place)
        self._decide()

    def _scan(self, places: dict[str, Place]) -> None:
        """Claim the targets that have entered the escape area or, at the first scan of the run, any in view."""
        pose = self._pose()
        own, zones = (pose.x_m, pose.y_m), self._settings.zones
        if self._first:
            self._claimed |= set(places)
        elif self._in_view is not None:
            self._claimed |= {target for target, place in places.items()
                              if target not in self._in_view and zones.distance_m(own, place) <= zones.escape_m}
        self._claimed &= set(places)
        self._first, self._in_view = False, set(places)

    # --- the fusion center

    def _hear_radio(self, data: bytes) -> None:
        frame = unpack(self._team, data)
        if frame is None:
            self._board.count("unreadable frames")
        elif isinstance(frame, Charges):
            if self._version < 0 or newer(frame.version, self._version):
                self._version = frame.version
                self._claimed.clear()
                self._follow(frame.target_of.get(self._board.name, ""))
        elif isinstance(frame, News) and frame.sensor == self._board.name and frame.target == self._target:
            self._after_execution(lambda: self._told(frame))

    def _told(self, news: News) -> None:
        for seen_ns, place in news.detections:
            if seen_ns not in self._known:          # a known one is here if the radio lost the robot's own reading
                self._known.add(seen_ns)
                self._detected(seen_ns, place)
                self._board.count("detections of others")
        self._decide()

    def _follow(self, target: str) -> None:
        """Follow `target` from now on, with a new filter that starts from the newest detection of it."""
        if target == self._target:
            return
        self._target, self._in_view = target, None
        self._known.clear()
        self._pursuer = self._settings.pursuer(self._board.rng) if target else None
        self._board.event("in charge" if target else "idle", target)
        if target in self._sighted:
            seen_ns, place = self._sighted[target]
            self._known.add(seen_ns)
            self._detected(seen_ns, place)
