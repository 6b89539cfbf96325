"""Model-based estimation of the tracking error between looks (section 4.7), and a trigger by the error it can have.

The controller moves a model of both robots from the last measurement on: R1 by the commands that it gives, R2 by the
inputs that it was told. Its estimate x^ moves as (4.3) with omega^_p; the command follows x^ at control instants. So

    e3' = e_omega2,   |(e1, e2)|' <= |v^| 2 |sin(e3 / 2)| + |e_omega1|          e = x^ - x, rotation leaves |(e1, e2)|

    |e3(t)| <= nu + w t,   |(e1, e2)(t)| <= sqrt(2) nu + w t + |v^| (nu t + w t^2 / 2)

with |nu_k| <= nu, |e_omega,k| <= w. Neither depends on x: y~ of (4.25) is |e_omega| alone, its gain from e is 0, and
the small-gain condition holds for every tau. Without noise and e_omega e stays 0 and one look is enough. How long a
model is good is a question of the error allowed, not of stability: tau_i is the longest with |e| <= `tolerance`.

Differs from the dissertation: it holds x^ constant (4.9), so that e' = -x' and the gain of the whole loop bounds tau.
Not modelled: wheels that do not follow the command; an e_omega above w, which neither robot could notice.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import hypot, isfinite, sqrt

from agents.tracking.arcs import arc
from agents.tracking.controller import Command, Inputs, Pose, State, tracking_error
from agents.tracking.error_system import NOISE, TrackingErrorSystem
from agents.triggering.policies import Decision

INPUT_ERROR = 0.3               # e_omega of section 4.6 [m/s, rad/s]
LONGEST_NS = 10_000_000_000     # interval that no tolerance exceeds
SHORTEST_NS = 1_000
GAIN_PER_S = 1e-3               # told in place of the gain 0, which it bounds: a horizon is a quotient by it


class PredictedState:
    """x^ from one measurement on; R1 starts at the origin of its frame."""

    def __init__(self, measured: State, inputs: Inputs) -> None:
        self._own, self._reference, self._inputs = Pose(0.0, 0.0, 0.0), Pose(*measured), Command(*inputs)

    def advance(self, command: Command, h_s: float) -> State:
        """Return x^ after `h_s` more, in which R1 drives `command`."""
        self._own = arc(self._own, command, h_s)
        self._reference = arc(self._reference, self._inputs, h_s)
        return tracking_error(self._own, self._reference)


def largest_error(v_mps: float, noise: float, input_error: float, tau_s: float) -> float:
    """Return the bound of |e| (metres and radians alike) `tau_s` after a measurement, for |v^| = `v_mps`."""
    heading = noise + input_error * tau_s
    away = sqrt(2) * noise + input_error * tau_s + abs(v_mps) * (noise + input_error * tau_s / 2) * tau_s
    return hypot(away, heading)


@dataclass
class PredictedError:
    """A policy: the next look is due when |e| could exceed `tolerance`."""

    tolerance: float                # [m, rad], above sqrt(3) noise
    noise: float = NOISE
    input_error: float = INPUT_ERROR
    watch_ns: int = field(default=0, init=False)
    last: Decision | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        if not (isfinite(self.noise) and self.noise >= 0 and isfinite(self.input_error) and self.input_error >= 0):
            raise ValueError(f"noise={self.noise}, input_error={self.input_error}: expected amplitudes of 0 or more")
        if not self.tolerance > sqrt(3) * self.noise:
            raise ValueError(f"tolerance={self.tolerance}: a measurement alone may be {sqrt(3) * self.noise:.6g} off, "
                             "expected more; allow a larger error, or measure better")
        self._system = TrackingErrorSystem(noise=self.noise)

    def decide(self, measured_ns: int, x: State, inputs: Inputs) -> Decision:
        inputs = self._system.admissible(inputs)
        self._system.predict(x, inputs, inputs)             # it refuses what is no measurement
        tau_ns = max(self._longest_ns(inputs.v_mps), SHORTEST_NS)
        self.last = Decision(measured_ns, tau_ns, tau_ns, GAIN_PER_S, 0.0)
        return self.last

    def look(self, now_ns: int, x: State) -> Decision:
        assert self.last is not None, "look before decide"
        return self.last

    def _longest_ns(self, v_mps: float) -> int:
        low, high = 0, LONGEST_NS
        while high - low > 1:
            middle = (low + high) // 2
            if largest_error(v_mps, self.noise, self.input_error, middle * 1e-9) <= self.tolerance:
                low = middle
            else:
                high = middle
        return low
