"""The fusion center as a node: it receives readings over the radio and sends assignments and merged detections.

    report   --gather_ns-->     merge the readings of one instant     -->  send `news` to the sensor in charge
    claim    --execution_ns-->  decide which sensor is in charge      -->  send `charges` to all, and every `repeat_ns`

Charges are repeated because receivers do not acknowledge broadcasts; news are not, since later news replace them. News
leave out detections with a reading of the sensor in charge, which has applied it already.
Source: dissertation, sections 3.2 and 3.3.2, Figure 3.3. Not modelled: sensors that report false readings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from agents.pursuit.fusion_center import FusionCenter, Reading
from agents.pursuit.team_frames import Charges, News, Report, pack_charges, pack_news, team_of, unpack
from firmware_sim.board import Board
from firmware_sim.scenario_view import Own, ScenarioView

COUNTERS = ("unreadable frames", "frames of others", "readings", "readings refused", "readings left out", "hand-overs",
            "merged")


@dataclass(frozen=True)
class FusionCenterSettings:
    radio: str = "radio"                # name of the port
    keep: int = 5                       # detections kept per target, Gamma of the filters
    execution_ns: int = 1_000_000       # from a claim until the charges are sent
    gather_ns: int = 20_000_000         # from the first reading of a target until its news are sent
    repeat_ns: int = 500_000_000        # period of the charges

    def __post_init__(self) -> None:
        if not 0 < self.execution_ns <= self.gather_ns or self.repeat_ns < 1:
            raise ValueError(f"execution_ns={self.execution_ns}, gather_ns={self.gather_ns}, repeat_ns="
                             f"{self.repeat_ns}: expected 0 < execution <= gather, and more than 0")


class FusionCenterNode:
    Settings = FusionCenterSettings
    has_execution_time = True

    def __init__(self, board: Board, settings: FusionCenterSettings) -> None:
        self._board, self._settings = board, settings
        self._team = team_of(board.team)
        for counter in COUNTERS:
            board.count(counter, 0)
        self._center = FusionCenter(board.rng, settings.keep)
        self._version = 0
        self._taken: dict[str, int] = {}            # target -> time at which its sensor in charge saw it enter
        self._gathering: set[str] = set()           # targets whose readings are being gathered
        self._port = board.port(settings.radio, self._hear)
        board.every(settings.repeat_ns, self._tell_charges, offset_ns=settings.repeat_ns)

    @staticmethod
    def check(scenario: ScenarioView, own: Own[FusionCenterSettings]) -> Iterator[str]:
        """Yield what is wrong with the scenario's `[team]`."""
        try:
            team_of(scenario.team)
        except ValueError as error:
            yield str(error)

    def _hear(self, data: bytes) -> None:
        report = unpack(self._team, data)
        if not isinstance(report, Report):
            self._board.count("unreadable frames" if report is None else "frames of others")
            return
        now_ns = self._board.now_ns
        try:
            counted = self._center.report(now_ns, Reading(report.sensor, report.target, report.seen_ns, report.place,
                                                          report.sigma_m))
        except ValueError as error:
            self._board.count("readings refused")
            self._board.event("reading refused", str(error))
            counted = False
        self._board.count("readings" if counted else "readings left out")
        if report.claims:
            self._after(self._board.execution_ns(self._settings.execution_ns), lambda: self._claim(report))
        if counted and report.target not in self._gathering:
            self._gathering.add(report.target)
            self._after(self._settings.gather_ns, lambda: self._pass_on(report.target))

    def _claim(self, report: Report) -> None:
        """Decide a claim and send the charges in any case, since the claiming sensor waits for an answer.

        Of two claims of one instant the first succeeds."""
        before = self._center.in_charge_of(report.target)
        if (before != report.sensor and self._taken.get(report.target, -1) < report.seen_ns
                and self._center.claim(report.sensor, {report.target}) is not None):
            self._taken[report.target] = report.seen_ns
            self._board.count("hand-overs", int(before is not None))
            self._board.event("in charge", f"{report.sensor} of {report.target}"
                                                + (f", after {before}" if before else ""))
        self._version += 1
        self._tell_charges()

    def _tell_charges(self) -> None:
        target_of = {sensor: target for sensor in self._team.sensors
                     if (target := self._center.target_of(sensor)) is not None}
        self._port.send(pack_charges(self._team, Charges(self._version, target_of)))

    def _pass_on(self, target: str) -> None:
        self._gathering.discard(target)
        sensor = self._center.in_charge_of(target)
        if sensor is None:
            return
        news = self._center.pass_on(sensor, with_own=False)
        if news:
            self._board.count("merged", sum(len(detection.sensors) > 1 for detection in news))
            self._port.send(pack_news(self._team, News(sensor, target, tuple(
                (detection.seen_ns, detection.place) for detection in news))))

    def _after(self, delay_ns: int, action: Callable[[], None]) -> None:
        self._board.at(self._board.now_ns + delay_ns, action)
