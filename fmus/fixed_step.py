"""Communication points of an FMU that takes only steps of one size: the multiples of the step from time 0.

The step is the decimal number that the description writes, kept as a fraction, so that the k-th point is exact:

    t_k = k p / q  [ns]          in simulated time: t_k rounded to the nearest nanosecond

Equal steps are handed to the FMU as one and the same floating point number, and no step is added to another.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction


@dataclass(frozen=True)
class FixedStep:
    numerator: int              # p of the step p / q [ns]
    denominator: int            # q

    @staticmethod
    def of_seconds(step_s: float) -> FixedStep:
        """From the seconds that a description writes: 0.004 is 4000000 ns exactly."""
        step = Fraction(repr(step_s)) * 10**9
        if step < 1:
            raise ValueError(f"a step of {step_s} s: expected at least 1 ns, the resolution of simulated time")
        return FixedStep(step.numerator, step.denominator)

    def points_until(self, t_ns: int) -> int:
        """The largest k whose point, rounded to a nanosecond, is not after `t_ns` (>= 0)."""
        return ((2 * t_ns + 1) * self.denominator - 1) // (2 * self.numerator)

    def instant_ns(self, point: int) -> int:
        """The k-th point in simulated time; a half is rounded up."""
        return (2 * point * self.numerator + self.denominator) // (2 * self.denominator)

    def seconds(self, points: int) -> float:
        """The length of that many steps as FMI takes it: the nearest floating point number."""
        return points * self.numerator / (self.denominator * 10**9)
