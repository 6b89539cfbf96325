"""A pursuer that moves freely in the plane (3.1), as the no-escape theorem assumes; its plant takes velocities.

    k T_s       the sensing medium `view` exposes if the pursuer has requested it; the answer comes soon after
    + execution_ns      apply the answers; decide; request a look at (k + 1) T_s?; velocity (3.6), held for T_s

Held for T_s, the velocity (3.6) leads straight towards the detection and, as long as K T_s <= 1, not beyond it: the
pursuer does not recede from the detection, which is all that the theorem's proof asks of it (`no_escape`). It knows its
own place exactly.

Not modelled: inertia, wheels, and computations that take longer than `execution_ns`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import nan

from agents.pursuit import Place
from agents.pursuit.detections import take_in
from agents.pursuit.pursuer_check import chase_problems
from agents.pursuit.pursuer_settings import ChaseSettings
from firmware_sim.board import Board
from firmware_sim.scenario_view import Own, ScenarioView
from netem.media.sensing.sight import LOOK, NothingSeen, unpack_sight

COUNTERS = ("looks", "looks that saw nothing", "detections", "detections refused", "detections too late",
            "unreadable sights")


class FreePursuer:
    Settings = ChaseSettings

    def __init__(self, board: Board, settings: ChaseSettings) -> None:
        self._board, self._settings = board, settings
        self._pursuer = settings.pursuer(board.rng)
        self._place = board.sensors(["x", "y"], ["m", "m"])
        self._velocity = board.actuators(["v_x_cmd", "v_y_cmd"])
        self._view = board.port(settings.view, self._see, listen_only=True)
        self._seen: list[tuple[int, Place]] = []        # detections that have not been applied yet
        self._newest: Place = (nan, nan)
        for counter in COUNTERS:
            board.count(counter, 0)
        board.record_all([("estimate_x", "m"), ("estimate_y", "m"), ("detection_x", "m"), ("detection_y", "m")],
                         self._sample)
        board.every(settings.step_ns, self._decide, offset_ns=settings.execution_ns)

    @staticmethod
    def check(scenario: ScenarioView, own: Own[ChaseSettings]) -> Iterator[str]:
        """Yield the problems of `chase_problems`, a missing plant, and answers that are applied too late."""
        yield from chase_problems(scenario, own)
        for name, agent in own.items():
            settings = agent.settings
            if not agent.has_plant:
                yield (f"agents.{name}.plant: is missing; a pursuer that moves freely drives one: "
                       "{ fmu = \"omnidirectional\" }")
            view = scenario.media.get(settings.view)
            if view is None or view.settings is None or (camera := view.settings.camera(name)) is None:
                continue
            later = max(0, -(-(camera.latency_ns - settings.execution_ns) // settings.step_ns))
            applied_ns = settings.execution_ns + later * settings.step_ns
            if applied_ns > settings.latency_ns:
                yield (f"agents.{name}.parameters: latency_ns={settings.latency_ns}: an answer of "
                       f"media.{settings.view} is applied {applied_ns} ns after its exposure; take that or more")

    def _see(self, data: bytes) -> None:
        sight = unpack_sight(data)
        if sight is None:
            self._board.count("unreadable sights")
        elif isinstance(sight, NothingSeen):
            self._board.count("looks that saw nothing")
        elif sight.name == self._settings.target:
            self._seen.append((sight.exposed_ns, (sight.x_m, sight.y_m)))

    def _decide(self) -> None:
        now_ns = self._board.now_ns
        x_m, y_m = self._place.read()
        for seen_ns, place in self._seen:
            if take_in(self._board, self._pursuer, seen_ns, place, (x_m, y_m)):
                self._newest = place
        self._seen.clear()
        decision = self._pursuer.step(now_ns, (x_m, y_m))
        self._velocity.write(decision.velocity_mps)
        if decision.look_ns <= now_ns + self._settings.step_ns:
            self._pursuer.asked(decision.look_ns)
            self._view.send(LOOK)
            self._board.count("looks")

    def _sample(self) -> Sequence[float]:
        if self._pursuer.seen_ns is None:
            return [nan, nan, nan, nan]
        return [*self._pursuer.estimator.expect(self._board.now_ns), *self._newest]
