"""The companion computer of a pursuer on a differential drive: looks rarely, drives by law (3.6) over CAN.

    k T_s       --execution_ns-->  reckon own place from the wheels; decide; request a look at (k + 1) T_s?; setpoint
    detection   --execution_ns-->  apply it to the filter; new goal; decide again; setpoint

The program sends looks to the sensing medium `view`, whose exposures are T_s apart, and setpoints to the drive on
`can`, which sends the wheels' angles. It sends nothing in between, so its promise is the next of these instants, soft
because a detection makes it send earlier.

Not modelled: slip, so the robot knows its place; computations that compete for time (each takes `execution_ns`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import nan

from agents.pursuit import Place
from agents.pursuit.detections import take_in
from agents.pursuit.pursuer import Decision, Pursuer
from agents.pursuit.pursuer_check import pursuer_problems
from agents.pursuit.pursuer_settings import PursuerSettings
from agents.tracking.controller import Command, Pose
from agents.tracking.dead_reckoning import DeadReckoning
from agents.tracking.drive_link import DriveLink
from firmware_sim.board import Board
from netem.media.sensing.sight import LOOK, Detection, NothingSeen, unpack_sight

COUNTERS = ("looks", "looks that saw nothing", "detections", "detections refused", "detections too late",
            "unreadable sights", "unreadable CAN frames")


class PursuerRobot:
    Settings = PursuerSettings
    has_execution_time = True
    check = staticmethod(pursuer_problems)

    def __init__(self, board: Board, settings: PursuerSettings) -> None:
        self._board, self._target, self._settings = board, settings.target, settings
        robot = board.team["robot"]
        self._steering = settings.steering(robot["track_m"])
        bus = board.port(settings.can, self._hear_drive, listen_only=True)
        self._drive = DriveLink(bus, robot["wheel_radius_m"], robot["track_m"], robot["counts_per_turn"])
        self._reckoning = DeadReckoning(robot["wheel_radius_m"], robot["track_m"], Pose(*settings.start))
        self._view = board.port(settings.view, self._hear_view)
        self._pursuer: Pursuer | None = settings.pursuer(board.rng) if settings.target else None
        for counter in COUNTERS:
            board.count(counter, 0)
        self._looked_ns = -1                        # exposure of the last look requested
        self._sights: dict[int, list[Detection]] = {}       # exposure -> its detections, until they are applied
        self._newest: Place = (nan, nan)
        board.record_all([("estimate_x", "m"), ("estimate_y", "m"), ("detection_x", "m"), ("detection_y", "m")],
                         self._sample)
        board.every(settings.step_ns, self._end_of_execution, offset_ns=settings.execution_ns)

    # --- at every instant k T_s

    def _end_of_execution(self) -> None:
        """Act, unless the processor is slower than usual and needs longer."""
        nominal_ns = self._settings.execution_ns
        longer_ns = self._board.execution_ns(nominal_ns) - nominal_ns
        if longer_ns:
            self._board.at(self._board.now_ns + longer_ns, self._instant)
        else:
            self._instant()

    def _instant(self) -> None:
        self._decide()

    def _decide(self) -> None:
        """Send a setpoint, and request a look at the next instant if the policy says so."""
        if self._pursuer is None:
            self._drive.send(Command(0.0, 0.0))
            return
        now_ns = self._board.now_ns
        pose = self._pose()
        decision: Decision = self._pursuer.step(now_ns, (pose.x_m, pose.y_m))
        self._drive.send(self._steering.command(decision.velocity_mps, pose.theta_rad))
        if decision.look_ns <= now_ns + self._settings.step_ns and decision.look_ns > self._looked_ns:
            self._pursuer.asked(decision.look_ns)
            self._look(decision.look_ns)

    def _look(self, look_ns: int) -> None:
        self._looked_ns = look_ns
        self._view.send(LOOK)
        self._board.count("looks")

    # --- detections

    def _hear_view(self, data: bytes) -> None:
        sight = unpack_sight(data)
        if sight is None:
            self._board.count("unreadable sights")
            return
        if sight.exposed_ns not in self._sights:
            self._sights[sight.exposed_ns] = []
            self._after_execution(lambda: self._seen(sight.exposed_ns, self._sights.pop(sight.exposed_ns)))
        if isinstance(sight, NothingSeen):
            self._board.count("looks that saw nothing")
        else:
            self._sights[sight.exposed_ns].append(sight)

    def _seen(self, seen_ns: int, sights: Sequence[Detection]) -> None:
        for sight in sights:
            if sight.name == self._target:
                self._detected(seen_ns, (sight.x_m, sight.y_m))
        self._decide()

    def _detected(self, seen_ns: int, place: Place) -> None:
        """Apply a detection of the target, by this robot or another."""
        pose = self._pose()
        if self._pursuer is not None and take_in(self._board, self._pursuer, seen_ns, place, (pose.x_m, pose.y_m)):
            self._newest = place

    # --- the drive, and time

    def _pose(self) -> Pose:
        return self._reckoning.pose_at(self._board.now_ns)

    def _hear_drive(self, data: bytes) -> None:
        heard = self._drive.read(data)
        if heard is None:
            self._board.count("unreadable CAN frames")
        elif heard.angles_rad is not None:
            self._reckoning.read(self._board.now_ns - self._settings.odometry_age_ns, *heard.angles_rad)

    def _after_execution(self, action: Callable[[], None]) -> None:
        self._board.at(self._board.now_ns + self._board.execution_ns(self._settings.execution_ns), action)

    def _sample(self) -> Sequence[float]:
        seen = self._pursuer is not None and self._pursuer.seen_ns is not None
        expected = self._pursuer.estimator.expect(self._board.now_ns) if (
            seen and self._pursuer is not None) else (nan, nan)
        return [*expected, *(self._newest if seen else (nan, nan))]
