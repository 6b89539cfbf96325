"""The companion computer of the robot R1: it measures its tracking error when the trigger requires, and drives by it.

    look due:    send a request to the reference over the radio
    answer:      x^ from own pose and the reference's; u by (4.4); send a setpoint over CAN
                 tau_i by the policy (4.37): when the next look is due

A measurement's age counts from its request. The next request is sent early by the time that the last exchange took, or
by the longer delay d that the scenario tells (`look_delay`), so that the command computed from its answer is in force
within tau_i. If tau_i - d is shorter than d, requests overlap, and the newest decision known sets the interval.
A request without an answer is repeated (`Decision.attempt_ns`). An announcement of new inputs by the reference is a
measurement too (section 4.6).

    camera:      (policies that watch) the state between looks, from the medium `view`: it may prolong tau_i

A camera tells the reference's place; its heading is that of the last measurement, turned by its inputs.

The robot checks the trigger's assumptions with the information it has: an assumption that fails is recorded as an event
with its name, once until it holds again. A measurement is in force when the drive has confirmed the setpoint computed
from it. Inputs of the reference outside P violate an assumption, and are replaced by the nearest ones in P.

Not modelled: computing time between an answer and the setpoint; a tracking error of more than half a turn.
"""

from __future__ import annotations

from math import pi, remainder
from typing import Any

from agents.tracking.assumption_watch import IN_TIME, AssumptionWatch
from agents.tracking.check import companion_problems, prepared_delays
from agents.tracking.controller import Inputs, Pose, State, TrackingController, tracking_error
from agents.tracking.dead_reckoning import DeadReckoning
from agents.tracking.drive_limits import LimitedController, rim_speed
from agents.tracking.drive_link import DriveLink
from agents.tracking.error_system import LIMITS
from agents.tracking.look_delay import told
from agents.tracking.look_frames import ANSWER_BYTES, UNASKED, ReferenceState, pack_request, unpack_answer
from agents.tracking.look_port import REQUEST_ID, LookPort
from agents.tracking.looks_under_way import LooksUnderWay
from agents.tracking.noise import Noise
from agents.tracking.observed_error import ObservedError
from agents.tracking.optimal_preparation import POLICY, prepared_charts, prepared_tables
from agents.tracking.planned_gains import gains_of
from agents.tracking.team_policy import make_policy
from agents.tracking.tracking_settings import TrackingSettings
from agents.triggering.assumptions import (
    Assumption,
    announcement_violations,
    command_violations,
    delay_violations,
    input_violations,
    radius_violations,
    region_violations,
    table_violations,
    violations,
)
from agents.triggering.error_gain import horizon_s
from agents.triggering.policies import Decision
from firmware_sim.board import Board
from firmware_sim.board_timers import Timer
from firmware_sim.scenario_view import Own, Preparing, ScenarioView, unseen
from netem.media.sensing.sight import Detection, unpack_sight

COUNTERS = ("looks", "looks without an answer", "late answers", "measurements", "refused measurements",
            "unreadable frames", "unreadable CAN frames", "violated assumptions")
CLAMPED = "states outside the table"
DRAWN_ANEW = "particles drawn anew"
RETRY_NS = 20_000_000           # between requests before the first measurement, when no interval is certified
OVERLAPPING_NS = 1_000_000      # the same where requests overlap


class TrackingRobot:
    Settings = TrackingSettings
    check = staticmethod(companion_problems)

    @staticmethod
    def prepare(scenario: ScenarioView, own: Own[TrackingSettings],
                progress: Preparing = unseen) -> dict[str, Any]:
        """Return additions to the team table: how long looks take, and what the policy `optimal` needs."""
        return prepared_delays(scenario, own) | prepared_tables(scenario, own, progress)

    charts = staticmethod(prepared_charts)

    def __init__(self, board: Board, settings: TrackingSettings) -> None:
        robot = board.team["robot"]
        self._board, self._settings = board, settings
        self._delay = told(board.team, board.name)
        self._controller = (LimitedController(speed_max_mps=settings.speed_max_mps, track_m=robot["track_m"])
                            if settings.speed_max_mps else TrackingController())
        self._policy = make_policy(board.team, settings.policy, settings.policy_settings(self._delay), self._controller)
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
        if self._policy.watch_ns:
            board.port("view", self._see, listen_only=True)
        self._place = DeadReckoning(robot["wheel_radius_m"], robot["track_m"], Pose(*settings.start))
        self._x: State = (0.0, 0.0, 0.0)            # last measurement of the tracking error
        self._inputs: Inputs | None = None          # last received inputs of the reference
        self._latest: Decision | None = None        # decision of the newest measurement
        self._in_force: Decision | None = None      # decision of the measurement in force
        self._underway: dict[int, Decision] = {}    # decisions with an unconfirmed setpoint, by the setpoint's number
        self._looks = LooksUnderWay(self._delay.total_ns)
        self._heard: tuple[int, ReferenceState] | None = None       # the last state of the reference, and its time
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
        if overdue := self._looks.ask(now_ns):
            self._failed += overdue
            board.count("looks without an answer", overdue)
        self._radio.send(pack_request(self._looks.number))
        board.count("looks")
        self._check()
        latest = self._latest
        if latest is None:
            retry_ns = now_ns + (OVERLAPPING_NS if self._delay.total_ns else RETRY_NS)
        elif latest.delay_ns:
            retry_ns = now_ns + latest.interval_ns
        else:
            retry_ns = latest.attempt_ns(self._failed + 1) - self._exchange_ns
        self._schedule(max(retry_ns, now_ns + 1))

    def _next_look(self, decision: Decision) -> None:
        """Schedule the next look of the newest decision."""
        due_ns, early_ns = decision.next_ns, self._exchange_ns
        if decision.delay_ns:
            due_ns = max(decision.measured_ns, self._looks.last_ns or 0) + decision.interval_ns
            early_ns = max(self._exchange_ns - self._delay.request_ns - self._delay.answer_ns, 0)
        self._schedule(max(due_ns - early_ns, self._board.now_ns + 1))

    def _hear(self, data: bytes) -> None:
        found = unpack_answer(data)
        if found is None:
            self._board.count("unreadable frames")
            return
        number, state = found
        now_ns = self._board.now_ns
        if number == UNASKED:
            said_ns = now_ns - self._delay.least_answer_ns
            self._looks.forget(said_ns - self._delay.least_request_ns)      # an answer still to come would be older
            self._inputs = state.inputs
            self._measured(state, now_ns - self._delay.answer_ns, said_ns)
        elif (asked_ns := self._looks.answered(number)) is None:
            self._board.count("late answers")
        else:
            self._exchange_ns = now_ns - asked_ns
            seen_ns = (asked_ns + now_ns) // 2
            if self._delay.total_ns:
                seen_ns = asked_ns + int(self._exchange_ns * self._delay.request_share)
            self._measured(state, asked_ns, seen_ns)

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
        before, self._latest = self._latest, decision
        self._heard = seen_ns, state
        self._watch.judge((*input_violations(measured_ns, state.inputs, LIMITS, self._gains),
                           *announcement_violations(measured_ns, state.inputs, self._inputs or state.inputs),
                           *radius_violations(measured_ns, self._x, self._settings.certified_radius,
                                              self._noise.measured),
                           *region_violations(measured_ns, self._x, before, self._noise.measured),
                           *table_violations(decision, self._x)))
        self._watch.fail(delay_violations(decision))
        if decision.clamped:
            board.count(CLAMPED)
        self._inputs = state.inputs
        self._command = self._controller.command(self._x, state.inputs)
        if self._settings.speed_max_mps:
            self._judge_command(measured_ns, state.inputs)
        self._tell_drive(decision)
        board.count("measurements")
        self._next_look(decision)

    def _judge_command(self, measured_ns: int, inputs: Inputs) -> None:
        """Record whether the command of (4.4) exceeds what the drive can do."""
        wanted = TrackingController().command(self._x, inputs)
        found = command_violations(measured_ns, rim_speed(wanted, self._board.team["robot"]["track_m"]),
                                   self._settings.speed_max_mps)
        if not found:
            self._watch.hold((Assumption.COMMAND,))
        self._watch.fail(found)

    def _see(self, data: bytes) -> None:
        """Take what the camera saw of the reference between two looks: the last decision may hold longer."""
        sight, latest = unpack_sight(data), self._latest
        if sight is None:
            self._board.count("unreadable frames")
        if not isinstance(sight, Detection) or sight.name != self._settings.sees:
            return
        if latest is None or self._heard is None:
            return
        heard_ns, state = self._heard
        if sight.exposed_ns <= max(heard_ns, latest.measured_ns):
            return
        turned_rad = state.inputs.omega_rad_s * (sight.exposed_ns - heard_ns) * 1e-9
        x1, x2, x3 = tracking_error(self._place.pose_at(sight.exposed_ns),
                                    Pose(sight.x_m, sight.y_m, state.pose.theta_rad + turned_rad))
        prolonged = self._policy.look(sight.exposed_ns, self._noise.measure((x1, x2, remainder(x3, 2 * pi))))
        if prolonged.valid_ns <= latest.valid_ns or self._looks.waiting:
            return
        self._latest = prolonged
        self._underway = {number: prolonged if decision is latest else decision
                          for number, decision in self._underway.items()}
        if self._in_force is latest:
            self._put_in_force(prolonged)
        self._repeated = prolonged
        self._next_look(prolonged)

    # --- the drive

    def _tell_drive(self, decision: Decision) -> None:
        number = self._drive.send(self._command)
        self._underway.pop(number, None)        # its number, 0 to 255, was that of a setpoint the drive never confirmed
        self._underway[number] = decision
        if self._repeat is not None:
            self._repeat.cancel()
        self._repeated = decision
        self._repeat = self._board.at(self._board.now_ns + self._settings.refresh_ns,
                                      lambda: self._tell_drive(self._repeated))

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
        self._put_in_force(decision)
        if decision.in_time and now_ns <= decision.holds_until_ns + self._settings.actuation_ns:
            self._watch.hold(IN_TIME)

    def _put_in_force(self, decision: Decision) -> None:
        """Put `decision` in force, and check the assumptions when it ends and when it becomes unstable."""
        self._in_force = decision
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
