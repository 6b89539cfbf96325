"""The tracking loop without any network: R1, R2, controller and a triggering policy, with ideal or scripted links.

R1 drives the held command, R2 the inputs of the reference less e_omega(t). A measurement is the true tracking error
plus nu, taken when the policy or a change of the reference's inputs asks for it; its command acts at once. `noise` is
as section 4.6 prints it: nu uniform in [-0.15, 0.15]^3, e_omega continuous in [-0.3, 0.3]^2, here linear between
independent uniform values `knot_ns` apart (the dissertation says no more than "continuous").

Accuracy. Nothing is integrated in x: R1 moves on exact arcs, R2's heading is an exact parabola, and its way is
Gauss-Legendre quadrature with three points over steps h of at most 50 ms within which the inputs are linear. Its
remainder is h^7 f^(6) / 2016000, f = v cos theta. With |v|, |omega| <= 3.3 and |e_omega'| <= 6 per s, |f^(6)| < 3e5: a
step of 50 ms errs by less than 1.2e-10 m, 12 s of them by less than 3e-8 m.

Not modelled: delay, wheels, anything between the robots: emulated runs have them, and are compared with this one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import cos, hypot, sin, sqrt
from random import Random
from typing import NamedTuple

from agents.tracking.controller import Command, Inputs, Pose, State, TrackingController, tracking_error
from agents.tracking.reference_inputs import ReferenceInputs
from agents.triggering.policies import Decision, Policy

MS = 1_000_000
LONGEST_STEP_NS = 50 * MS
NODE, WEIGHTS = sqrt(0.6), (5 / 18, 8 / 18, 5 / 18)         # Gauss-Legendre on [-1, 1], weights for [0, 1]


@dataclass
class Noise:
    """Both disturbances of section 4.6; zero amplitudes switch one off."""

    measuring: Random                   # draws nu
    driving: Random                     # draws e_omega
    measured: float = 0.15              # [m, m, rad]
    inputs: float = 0.3                 # [m/s, rad/s]
    knot_ns: int = 100 * MS
    _knots: list[Inputs] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        if not (self.measured >= 0 and self.inputs >= 0):
            raise ValueError(f"measured={self.measured}, inputs={self.inputs}: expected amplitudes of 0 or more")
        if self.knot_ns < 1:
            raise ValueError(f"knot_ns={self.knot_ns}: expected 1 or more between values of e_omega")

    def measure(self, x: State) -> State:
        a = self.measured
        nu1, nu2, nu3 = (a * (2 * self.measuring.random() - 1) for _ in range(3))
        return x[0] + nu1, x[1] + nu2, x[2] + nu3

    def next_knot_ns(self, t_ns: int) -> int:
        return (t_ns // self.knot_ns + 1) * self.knot_ns

    def input_error(self, t_ns: int) -> Inputs:
        k, into_ns = divmod(t_ns, self.knot_ns)
        while len(self._knots) < k + 2:
            v, omega = (self.inputs * (2 * self.driving.random() - 1) for _ in range(2))
            self._knots.append(Inputs(v, omega))
        share = into_ns / self.knot_ns
        (v0, omega0), (v1, omega1) = self._knots[k], self._knots[k + 1]
        return Inputs(v0 + share * (v1 - v0), omega0 + share * (omega1 - omega0))


class Transmission(NamedTuple):
    t_ns: int
    x: State
    measured: State | None      # None: lost
    command: Command            # in force from here on
    decision: Decision          # in force from here on, as prolonged by looks
    forced: bool                # by a change of the reference's inputs


class Sample(NamedTuple):
    t_ns: int
    x: State
    e: State                    # x^ - x, x^ the measurement in force


@dataclass(frozen=True)
class Run:
    transmissions: list[Transmission]
    samples: list[Sample]

    @property
    def intervals_ns(self) -> list[int]:
        """tau_i as decided, one for each measurement that arrived."""
        return [sent.decision.interval_ns for sent in self.transmissions if sent.measured is not None]

    def rms(self, from_ns: int, to_ns: int) -> float:
        """Root mean square of |x| over the samples of [from_ns, to_ns]."""
        norms = [hypot(*sample.x) for sample in self.samples if from_ns <= sample.t_ns <= to_ns]
        return sqrt(sum(norm * norm for norm in norms) / len(norms))


def run(policy: Policy[State, Inputs], reference: ReferenceInputs, start: State, length_ns: int, *,
        controller: TrackingController | None = None, noise: Noise | None = None, sample_ns: int = 10 * MS,
        lost: Callable[[int], bool] = lambda attempt: False) -> Run:
    """Everything from 0 until `length_ns`, which is sampled but no longer transmitted at.

    Transmission number k, from 0, is lost if `lost(k)`; number 0 must not be. A lost one is repeated after the
    decision's interval; a lost announcement of new inputs leaves the old ones in force at R1.
    """
    if lost(0):
        raise ValueError("lost(0): the first transmission must arrive, there is no command before it")
    if length_ns < 1 or sample_ns < 1:
        raise ValueError(f"length_ns={length_ns}, sample_ns={sample_ns}: expected 1 or more")
    return _Loop(policy, reference, start, length_ns, controller or TrackingController(),
                 noise or Noise(Random(0), Random(0), 0.0, 0.0), sample_ns, lost).run()


class _Loop:
    def __init__(self, policy: Policy[State, Inputs], reference: ReferenceInputs, start: State, length_ns: int,
                 controller: TrackingController, noise: Noise, sample_ns: int, lost: Callable[[int], bool]) -> None:
        self.policy, self.reference, self.length_ns, self.controller = policy, reference, length_ns, controller
        self.noise, self.sample_ns, self.lost = noise, sample_ns, lost
        self.now_ns = 0
        self.own, self.other = Pose(0.0, 0.0, 0.0), Pose(*start)
        self.transmissions: list[Transmission] = []
        self.samples: list[Sample] = []
        self.decision: Decision             # in force, as are the next two, from the first transmission on
        self.command: Command
        self.believed: State
        self.due_ns = self.failed = 0

    @property
    def x(self) -> State:
        return tracking_error(self.own, self.other)

    def run(self) -> Run:
        watch_ns = self.policy.watch_ns
        never = self.length_ns
        changes = [t_ns for t_ns in self.reference.changes_ns if t_ns < self.length_ns]
        self._transmit(forced=False)
        self._sample()
        look_ns = watch_ns or never
        while self.now_ns < self.length_ns:
            change_ns = changes[0] if changes else never
            sample_ns = min((self.now_ns // self.sample_ns + 1) * self.sample_ns, self.length_ns)
            self._advance(min(self.due_ns, change_ns, look_ns, sample_ns))
            if self.now_ns < self.length_ns and self.now_ns in (change_ns, self.due_ns):
                forced = self.now_ns == change_ns
                del changes[:forced]
                if self._transmit(forced) and watch_ns:
                    look_ns = self.now_ns + watch_ns
            elif self.now_ns == look_ns < self.length_ns:
                self.decision = self.policy.look(self.now_ns, self.noise.measure(self.x))
                self.due_ns = self.decision.attempt_ns(self.failed)
                self.transmissions[-1] = self.transmissions[-1]._replace(decision=self.decision)
            if look_ns <= self.now_ns:
                look_ns = self.now_ns + watch_ns
            if self.now_ns == sample_ns:
                self._sample()
        return Run(self.transmissions, self.samples)

    def _transmit(self, forced: bool) -> bool:
        """Whether it arrived."""
        x, measured = self.x, None
        if not self.lost(len(self.transmissions)):
            measured = self.noise.measure(x)
            inputs = self.reference.at(self.now_ns)
            self.decision = self.policy.decide(self.now_ns, measured, inputs)
            self.command = self.controller.command(measured, inputs)
            self.believed, self.failed = measured, 0
        elif not forced:
            self.failed += 1
        self.due_ns = self.decision.attempt_ns(self.failed)
        self.transmissions.append(Transmission(self.now_ns, x, measured, self.command, self.decision, forced))
        return measured is not None

    def _sample(self) -> None:
        x1, x2, x3 = x = self.x
        b1, b2, b3 = self.believed
        self.samples.append(Sample(self.now_ns, x, (b1 - x1, b2 - x2, b3 - x3)))

    def _advance(self, until_ns: int) -> None:
        while self.now_ns < until_ns:
            start_ns = self.now_ns
            self.now_ns = min(until_ns, self.noise.next_knot_ns(start_ns), start_ns + LONGEST_STEP_NS)
            h_s = (self.now_ns - start_ns) * 1e-9
            v, omega = self.reference.at(start_ns)
            before, after = self.noise.input_error(start_ns), self.noise.input_error(self.now_ns)
            self.own = arc(self.own, self.command, h_s)
            self.other = ramp(self.other, Inputs(v - before.v_mps, omega - before.omega_rad_s),
                              Inputs(v - after.v_mps, omega - after.omega_rad_s), h_s)


def arc(pose: Pose, command: Command, h_s: float) -> Pose:
    """Where a unicycle is after h_s of constant velocities, exactly."""
    v, omega = command
    half = omega * h_s / 2
    chord = v * h_s * (sin(half) / half if half else 1.0)
    middle = pose.theta_rad + half
    return Pose(pose.x_m + chord * cos(middle), pose.y_m + chord * sin(middle), pose.theta_rad + 2 * half)


def ramp(pose: Pose, before: Inputs, after: Inputs, h_s: float) -> Pose:
    """Where a unicycle is after h_s of velocities that change linearly; see the accuracy above."""
    x_m, y_m, theta = pose
    (v0, omega0), (v1, omega1) = before, after
    for node, weight in zip((-NODE, 0.0, NODE), WEIGHTS, strict=True):
        s = (1 + node) / 2
        v = (v0 + s * (v1 - v0)) * weight * h_s
        heading = theta + s * h_s * (omega0 + s * (omega1 - omega0) / 2)
        x_m += v * cos(heading)
        y_m += v * sin(heading)
    return Pose(x_m, y_m, theta + h_s * (omega0 + omega1) / 2)
