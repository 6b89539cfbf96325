"""The companion computer of the robot R1: it measures its tracking error when the trigger requires, and drives by it.

    look due:    send a request to the reference over the radio
    answer:      x^ from own pose and the reference's; u by (4.4); send a setpoint over CAN
                 tau_i by the policy (4.37): when the next look is due

A measurement's age counts from its request. The next request is sent early by the time that the last exchange took, so
that the command computed from its answer is in force within tau_i. A request without an answer is repeated
(`Decision.attempt_ns`). An announcement of new inputs by the reference is a measurement too (section 4.6).

The robot checks the trigger's assumptions with the information it has: an assumption that fails is recorded as an event
with its name, once until it holds again. A measurement is in force when the drive has confirmed the setpoint computed
from it. Inputs of the reference outside P violate an assumption, and are replaced by the nearest ones in P.

Not modelled: computing time between an answer and the setpoint; a tracking error of more than half a turn.
"""

from __future__ import annotations

from math import pi, remainder

from agents.tracking.assumption_watch import IN_TIME, AssumptionWatch
from agents.tracking.check import companion_problems
from agents.tracking.controller import Inputs, Pose, State, TrackingController, tracking_error
from agents.tracking.dead_reckoning import DeadReckoning
from agents.tracking.drive_link import DriveLink
from agents.tracking.error_system import LIMITS
from agents.tracking.look_frames import ANSWER_BYTES, UNASKED, ReferenceState, pack_request, unpack_answer
from agents.tracking.look_port import REQUEST_ID, LookPort
from agents.tracking.noise import Noise
from agents.tracking.observed_error import ObservedError
from agents.tracking.optimal_preparation import POLICY, prepare
from agents.tracking.planned_gains import gains_of
from agents.tracking.team_policy import make_policy
from agents.tracking.tracking_settings import TrackingSettings
from agents.triggering.assumptions import (
    announcement_violations,
    input_violations,
    radius_violations,
    table_violations,
    violations,
)
from agents.triggering.error_gain import horizon_s
from agents.triggering.policies import Decision
from firmware_sim.board import Board
from firmware_sim.board_timers import Timer

COUNTERS = ("looks", "looks without an answer", "late answers", "measurements", "refused measurements",
            "unreadable frames", "unreadable CAN frames", "violated assumptions")
CLAMPED = "states outside the table"
DRAWN_ANEW = "particles drawn anew"
RETRY_NS = 20_000_000           # between requests before the first measurement, when no interval is certified


class TrackingRobot:
    Settings = TrackingSettings
    check = staticmethod(companion_problems)
    prepare = staticmethod(prepare)

    def __init__(self, board: Board, settings: TrackingSettings) -> None:
        robot = board.team["robot"]
        self._board, self._settings = board, settings
        self._controller = TrackingController()
        self._policy = make_policy(board.team, settings.policy, settings.policy_settings())
        self._gains = gains_of(board.team)
        self._watch = AssumptionWatch(board, settings.policy)
        for counter in COUNTERS:
            board.count(counter, 0)
        if settings.policy == POLICY:
            board.count(CLAMPED, 0)
            if remark := board.team["optimal_remark"]:
                board.warn("optimal policy", remark)
        self._observed = self._observer() if settings.policy == POLICY else None
        self._noise = Noise(board.rng, board.rng, settings.measurement_noise, 0.0)
        self._radio = LookPort(board, REQUEST_ID, ANSWER_BYTES, self._hear)
        self._drive = DriveLink(board.port("can", self._hear_drive, listen_only=True), robot["wheel_radius_m"],
                                robot["track_m"], robot["counts_per_turn"])
        self._place = DeadReckoning(robot["wheel_radius_m"], robot["track_m"], Pose(*settings.start))
        self._x: State = (0.0, 0.0, 0.0)            # last measurement of the tracking error
        self._inputs: Inputs | None = None          # last received inputs of the reference
        self._latest: Decision | None = None        # decision of the newest measurement
        self._in_force: Decision | None = None      # decision of the measurement in force
        self._underway: dict[int, Decision] = {}    # decisions with an unconfirmed setpoint, by the setpoint's number
        self._look = -1                             # number of the last request
        self._asked_ns: int | None = None           # time of the last request; None: it was answered
        self._failed = 0                            # requests in a row without an answer
        self._exchange_ns = 0                       # duration of the last exchange
        self._repeat: Timer | None = None           # repeats the setpoint
        board.record_all([("held1", "m"), ("held2", "m"), ("held3", "rad"), ("tau", "s"), ("gain_product", "1")],
                         self._sample)
        if settings.policy == POLICY:               # tau is the cap then
            board.record("interval", "s", lambda: self._in_force.interval_ns * 1e-9 if self._in_force else 0.0)
        self._due = board.at(board.now_ns, self._ask)       # the next look

    def _observer(self) -> ObservedError | None:
        kind, disturbance = self._board.team["optimal_observer"], self._board.team["optimal_disturbance"]
        if kind == "none":
            return None
        self._board.count(DRAWN_ANEW, 0)
        return ObservedError(kind, self._board.rng, self._settings.measurement_noise, disturbance)

    def _estimate(self, seen_ns: int, inputs: Inputs) -> None:
        """Replace the measurement by the observer's estimate, and tell if its particles were drawn anew."""
        if self._observed is None:
            return
        held = None if self._inputs is None else self._command
        self._x = self._observed.look(seen_ns, self._x, held, inputs)
        if self._observed.drawn_anew:
            self._board.count(DRAWN_ANEW)
            self._board.warn("particles drawn anew", "no particle explains the look; they start again around it")

    # --- looks

    def _schedule(self, due_ns: int) -> None:
        self._due.cancel()
        self._due = self._board.at(due_ns, self._ask)

    def _ask(self) -> None:
        board = self._board
        now_ns = board.now_ns
        if self._asked_ns is not None:
            self._failed += 1
            board.count("looks without an answer")
        self._look += 1
        self._asked_ns = now_ns
        self._radio.send(pack_request(self._look))
        board.count("looks")
        self._check()
        latest = self._latest
        retry_ns = now_ns + RETRY_NS if latest is None else latest.attempt_ns(self._failed + 1) - self._exchange_ns
        self._schedule(max(retry_ns, now_ns + 1))

    def _hear(self, data: bytes) -> None:
        found = unpack_answer(data)
        if found is None:
            self._board.count("unreadable frames")
            return
        number, state = found
        now_ns = self._board.now_ns
        if number == UNASKED:
            self._asked_ns = None                   # an answer still to come would be older
            self._inputs = state.inputs
            self._measured(state, now_ns, now_ns)
        elif self._asked_ns is None or number != self._look % UNASKED:
            self._board.count("late answers")
        else:
            asked_ns, self._asked_ns = self._asked_ns, None
            self._exchange_ns = now_ns - asked_ns
            self._measured(state, asked_ns, (asked_ns + now_ns) // 2)

    def _measured(self, state: ReferenceState, measured_ns: int, seen_ns: int) -> None:
        """Apply a measurement. `measured_ns`: start of its age; `seen_ns`: best estimate of when `state` was true."""
        board = self._board
        x1, x2, x3 = tracking_error(self._place.pose_at(seen_ns), state.pose)
        self._x = self._noise.measure((x1, x2, remainder(x3, 2 * pi)))
        self._estimate(seen_ns, state.inputs)
        self._failed = 0
        try:
            decision = self._policy.decide(measured_ns, self._x, state.inputs)
        except ValueError as error:
            board.count("refused measurements")
            board.warn("refused measurement", str(error))
            return
        self._latest = decision
        self._watch.judge((*input_violations(measured_ns, state.inputs, LIMITS, self._gains),
                           *announcement_violations(measured_ns, state.inputs, self._inputs or state.inputs),
                           *radius_violations(measured_ns, self._x, self._settings.certified_radius,
                                              self._noise.measured),
                           *table_violations(decision, self._x)))
        if decision.clamped:
            board.count(CLAMPED)
        self._inputs = state.inputs
        self._command = self._controller.command(self._x, state.inputs)
        self._tell_drive(decision)
        board.count("measurements")
        self._schedule(max(decision.next_ns - self._exchange_ns, self._board.now_ns + 1))

    # --- the drive

    def _tell_drive(self, decision: Decision) -> None:
        number = self._drive.send(self._command)
        self._underway.pop(number, None)        # its number, 0 to 255, was that of a setpoint the drive never confirmed
        self._underway[number] = decision
        if self._repeat is not None:
            self._repeat.cancel()
        self._repeat = self._board.at(self._board.now_ns + self._settings.refresh_ns,
                                      lambda: self._tell_drive(decision))

    def _hear_drive(self, data: bytes) -> None:
        heard = self._drive.read(data)
        if heard is None:
            self._board.count("unreadable CAN frames")
            return
        if heard.angles_rad is not None:
            self._place.read(self._board.now_ns - self._settings.odometry_age_ns, *heard.angles_rad)
        if heard.confirmed is not None and heard.confirmed in self._underway:
            self._comes_into_force(heard.confirmed)

    def _comes_into_force(self, number: int) -> None:
        """Put the decision of setpoint `number`, which the drive confirmed, in force; drop those sent before it."""
        decision = self._underway[number]
        sent = list(self._underway)
        self._underway = {later: self._underway[later] for later in sent[sent.index(number) + 1:]}
        before = self._in_force
        if decision is before:
            return
        board, now_ns = self._board, self._board.now_ns
        if before is not None:
            self._check()
            until_ns = now_ns - self._settings.actuation_ns
            board.event("gain product", f"{before.gain_product(until_ns):.6g} after "
                                       f"{max(until_ns - before.measured_ns, 0) * 1e-9:.6g} s")
        self._in_force = decision
        if now_ns <= decision.holds_until_ns + self._settings.actuation_ns:
            self._watch.hold(IN_TIME)
        unstable_ns = decision.measured_ns + int(horizon_s(decision.growth_per_s, decision.gain_per_s, 1.0) * 1e9)
        for end_ns in (decision.holds_until_ns, unstable_ns):
            self._board.at(end_ns + 1 + self._settings.actuation_ns,
                           lambda: self._check() if self._in_force is decision else None, sends=False)

    # --- assumptions

    def _check(self) -> None:
        """Record an event for each assumption of the trigger that has failed since the last check."""
        if self._in_force is not None:
            self._watch.fail(violations(self._in_force, self._board.now_ns - self._settings.actuation_ns, self._failed))

    def _sample(self) -> list[float]:
        decision = self._in_force
        if decision is None:
            return [*self._x, 0.0, 0.0]
        now_ns = self._board.now_ns
        return [*self._x, decision.valid_ns * 1e-9, decision.gain_product(now_ns)]
