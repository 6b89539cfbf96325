"""The tracking loop without any network: R1, R2, controller and a triggering policy, with ideal or scripted links.

R1 drives the held command, R2 the inputs of the reference less e_omega(t). A measurement is the true tracking error
plus nu, taken when the policy or a change of the reference's inputs asks for it; its command acts at once. With
`predict_ns` the controller predicts the state between measurements (`predicted_error`), and renews the command from the
predicted state every `predict_ns` after a measurement.

Accuracy. R1 moves on exact arcs, R2 by quadrature over steps of at most 50 ms within which its inputs are linear
(`arcs.py`); x is computed from both poses. The error after 12 s is below 3e-8 m.

Not modelled: delay, wheels, obstacles: emulated runs have them, and are compared with this one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, sqrt
from random import Random
from typing import NamedTuple

from agents.tracking.arcs import arc, ramp
from agents.tracking.controller import Command, Inputs, Pose, State, TrackingController, tracking_error
from agents.tracking.noise import Noise
from agents.tracking.predicted_error import PredictedState
from agents.tracking.reference_inputs import ReferenceInputs
from agents.triggering.policies import Decision, Policy

MS = 1_000_000
LONGEST_STEP_NS = 50 * MS


class Transmission(NamedTuple):
    t_ns: int
    x: State
    measured: State | None      # None: lost
    command: Command            # in force from here on
    decision: Decision          # in force from here on, as prolonged by looks
    forced: bool                # True: caused by a change of the reference's inputs


class Sample(NamedTuple):
    t_ns: int
    x: State
    e: State                    # x^ - x, x^ the measurement in force, or predicted from it


@dataclass(frozen=True)
class Run:
    transmissions: list[Transmission]
    samples: list[Sample]

    @property
    def intervals_ns(self) -> list[int]:
        """tau_i as decided, one for each measurement that arrived."""
        return [sent.decision.interval_ns for sent in self.transmissions if sent.measured is not None]

    def rms(self, from_ns: int, to_ns: int) -> float:
        """Return the root mean square of |x| over the samples in [from_ns, to_ns]."""
        norms = [hypot(*sample.x) for sample in self.samples if from_ns <= sample.t_ns <= to_ns]
        return sqrt(sum(norm * norm for norm in norms) / len(norms))


def run(policy: Policy[State, Inputs], reference: ReferenceInputs, start: State, length_ns: int, *,
        controller: TrackingController | None = None, noise: Noise | None = None, sample_ns: int = 10 * MS,
        lost: Callable[[int], bool] = lambda attempt: False, predict_ns: int = 0) -> Run:
    """Run the loop over [0, length_ns]; at `length_ns` there is a sample but no transmission.

    Transmission number k, from 0, is lost if `lost(k)`, which must be False for 0. A lost transmission is repeated
    after the decision's interval; a lost announcement of new inputs leaves the old ones in force at R1. Raises
    ValueError for a lost first transmission and for numbers out of range.
    """
    if lost(0):
        raise ValueError("lost(0): the first transmission must arrive, there is no command before it")
    if length_ns < 1 or sample_ns < 1:
        raise ValueError(f"length_ns={length_ns}, sample_ns={sample_ns}: expected 1 or more")
    if predict_ns < 0:
        raise ValueError(f"predict_ns={predict_ns}: expected 0, or the time between two predicted commands")
    return _Loop(policy, reference, start, length_ns, controller or TrackingController(),
                 noise or Noise(Random(0), Random(0), 0.0, 0.0), sample_ns, lost, predict_ns).run()


class _Loop:
    def __init__(self, policy: Policy[State, Inputs], reference: ReferenceInputs, start: State, length_ns: int,
                 controller: TrackingController, noise: Noise, sample_ns: int, lost: Callable[[int], bool],
                 predict_ns: int) -> None:
        self.policy, self.reference, self.length_ns, self.controller = policy, reference, length_ns, controller
        self.noise, self.sample_ns, self.lost, self.predict_ns = noise, sample_ns, lost, predict_ns
        self.predicted: PredictedState | None = None
        self.now_ns = 0
        self.own, self.other = Pose(0.0, 0.0, 0.0), Pose(*start)
        self.transmissions: list[Transmission] = []
        self.samples: list[Sample] = []
        self.decision: Decision             # in force; set, as the next two, at the first transmission
        self.command: Command
        self.believed: State
        self.due_ns = self.failed = self.measured_ns = 0

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
            control_ns = self._next_control_ns()
            self._advance(min(self.due_ns, change_ns, look_ns, sample_ns, control_ns))
            if self.now_ns == control_ns:
                self.command = self.controller.command(self.believed, self.reference.at(self.measured_ns))
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
        """Transmit a measurement now; return whether it arrived."""
        x, measured = self.x, None
        if not self.lost(len(self.transmissions)):
            measured = self.noise.measure(x)
            inputs = self.reference.at(self.now_ns)
            self.decision = self.policy.decide(self.now_ns, measured, inputs)
            self.command = self.controller.command(measured, inputs)
            self.believed, self.failed, self.measured_ns = measured, 0, self.now_ns
            if self.predict_ns:
                self.predicted = PredictedState(measured, inputs)
        elif not forced:
            self.failed += 1
        self.due_ns = self.decision.attempt_ns(self.failed)
        self.transmissions.append(Transmission(self.now_ns, x, measured, self.command, self.decision, forced))
        return measured is not None

    def _next_control_ns(self) -> int:
        if not self.predict_ns:
            return self.length_ns + 1
        since_ns = self.now_ns - self.measured_ns
        return self.measured_ns + (since_ns // self.predict_ns + 1) * self.predict_ns

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
            if self.predicted is not None:
                self.believed = self.predicted.advance(self.command, h_s)
            self.other = ramp(self.other, Inputs(v - before.v_mps, omega - before.omega_rad_s),
                              Inputs(v - after.v_mps, omega - after.omega_rad_s), h_s)
