"""The disturbances of section 4.6: nu of the measurements and e_omega of the reference's inputs.

nu is uniform in [-0.15, 0.15]^3. e_omega is continuous in [-0.3, 0.3]^2, here linear between independent uniform
values `knot_ns` apart (the dissertation says no more than "continuous").
"""

from __future__ import annotations

from dataclasses import dataclass, field
from random import Random

from agents.tracking.controller import Inputs, State

MS = 1_000_000


@dataclass
class Noise:
    """Both disturbances of section 4.6; a zero amplitude switches one off."""

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
