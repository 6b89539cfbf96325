"""The error system of the tracking loop, for triggers: command, reachable set and error bound behind one interface.

A member of `agents.triggering.error_system.ErrorSystem`. It assumes that measurements are within `noise` of the true
error in each component, and inputs of R2 within `limits` (the set P of section 4.6). A measured input outside P is
replaced by the nearest one inside.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import isfinite, pi, sqrt

from agents.tracking.controller import Command, Inputs, State, TrackingController
from agents.tracking.error_bound import Bound, ErrorBound
from agents.tracking.reachable_set import SQRT_2, Extents, extents_until

NOISE = 0.15                    # nu of section 4.6 [m, m, rad]
LIMITS = Inputs(3.0, 3.0)       # P = [-3, 3] x [-3, 3]
FAR = 1e6                       # a larger tracking error is refused as a broken measurement


class TrackingPrediction:
    """A measurement and the command held from it on; ValueError for a tracking error not finite or above FAR."""

    def __init__(self, system: TrackingErrorSystem, x: State, command: Command, v_mps: float) -> None:
        self.command = command
        self._system, self._v_mps = system, v_mps
        self._growth_per_s = system.error_bound.growth_per_s
        self._extents_until = self._from(x)
        self._since_s = 0.0
        self._seen: Extents | None = None

    def _from(self, x: State) -> Callable[[float], Extents]:
        if not (abs(x[0]) < FAR and abs(x[1]) < FAR and abs(x[2]) < FAR):
            raise ValueError(f"x=({x[0]:.9g}, {x[1]:.9g}, {x[2]:.9g}): no tracking error [m, m, rad]; leave such a "
                             "measurement out")
        return extents_until(x, self.command, self._system.limits, self._system.noise)

    def growth_until(self, tau_s: float) -> float:
        if self._seen is None:
            return self._growth_per_s(self._v_mps, self._extents_until(tau_s))
        s1, s2, s3 = self._seen
        m1, m2, m3 = self._extents_until(max(tau_s - self._since_s, 0.0))
        return self._growth_per_s(self._v_mps, (max(s1, m1), max(s2, m2), max(s3, m3)))

    def look(self, elapsed_s: float, x: State) -> None:
        """Restart the prediction from x, measured `elapsed_s` after the start; the growth until then is kept."""
        until_now = self._extents_until(elapsed_s - self._since_s)
        if self._seen is not None:
            s1, s2, s3 = self._seen
            m1, m2, m3 = until_now
            until_now = max(s1, m1), max(s2, m2), max(s3, m3)
        self._extents_until, self._since_s, self._seen = self._from(x), elapsed_s, until_now


@dataclass(frozen=True)
class TrackingErrorSystem:
    controller: TrackingController = field(default_factory=TrackingController)
    bound: Bound = Bound.LEAST
    limits: Inputs = LIMITS
    noise: float = NOISE
    error_bound: ErrorBound = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not (isfinite(self.noise) and self.noise >= 0):
            raise ValueError(f"noise={self.noise}: expected the largest error of a measured component, 0 or more")
        if not (len(self.limits) == 2 and all(isfinite(limit) and limit > 0 for limit in self.limits)):
            raise ValueError(f"limits={self.limits}: expected the largest |v_R2| [m/s], |omega_R2| [rad/s], positive")
        object.__setattr__(self, "error_bound", ErrorBound(self.controller, self.bound))

    @property
    def worst_inputs(self) -> Inputs:
        """The inputs of P with the largest bound A, used with a unified gain."""
        return self.limits

    def largest_norm(self, x: State) -> float:
        """Return the largest |x| of a state that is within `noise` of x in each component, at most that more."""
        return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]) + self.noise * sqrt(3)

    def admissible(self, inputs: Inputs) -> Inputs:
        """Return the inputs of P nearest to `inputs`; ValueError if these are not numbers."""
        v_mps, omega_rad_s = inputs
        v_most, omega_most = self.limits
        if abs(v_mps) <= v_most and abs(omega_rad_s) <= omega_most:
            return inputs
        if v_mps != v_mps or omega_rad_s != omega_rad_s:
            raise ValueError(f"inputs={tuple(inputs)}: not a number; leave such a measurement out")
        return Inputs(min(max(v_mps, -v_most), v_most), min(max(omega_rad_s, -omega_most), omega_most))

    def predict(self, x: State, inputs: Inputs, bounded_by: Inputs) -> TrackingPrediction:
        return TrackingPrediction(self, x, self.controller.command(x, inputs), bounded_by.v_mps)

    def growth_within(self, inputs: Inputs, radius: float) -> Callable[[float], float]:
        """Return tau [s] -> growth [1/s] over [0, tau], for any measurement of a true error |x| <= radius."""
        k1, v_most = self.controller.k1_per_s, self.limits.v_mps
        measured = radius + self.noise
        speed_mps = 2 * v_most + k1 * measured          # R2's, and R1's by (4.4): |v_R1| <= |v_R2| + k1 |x1|

        def growth(tau_s: float) -> float:
            away_m = radius + 2 * SQRT_2 * self.noise + speed_mps * tau_s       # noise counts twice: measured, reached
            return self.error_bound.growth_per_s(inputs.v_mps, (away_m, away_m, pi))

        return growth
