"""Communication points of an FMU that takes only steps of one size: the multiples of the step from time 0.

The step is the decimal number in the description, kept as a fraction, so that the k-th point is exact:

    t_k = k p / q  [ns]          in simulated time: t_k rounded to the nearest nanosecond

The FMU gets equal steps as the same floating point number, and no time is a sum of steps.
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
        """Return the step of `step_s`, read as a decimal: 0.004 is 4000000 ns exactly. Raises ValueError below 1 ns."""
        step = Fraction(repr(step_s)) * 10**9
        if step < 1:
            raise ValueError(f"a step of {step_s} s: expected at least 1 ns, the resolution of simulated time")
        return FixedStep(step.numerator, step.denominator)

    def points_until(self, t_ns: int) -> int:
        """Return the largest k whose point, rounded to a nanosecond, is not after `t_ns` (>= 0)."""
        return ((2 * t_ns + 1) * self.denominator - 1) // (2 * self.numerator)

    def instant_ns(self, point: int) -> int:
        """Return the instant of the k-th point in simulated time [ns], half a nanosecond rounded up."""
        return (2 * point * self.numerator + self.denominator) // (2 * self.denominator)

    def seconds(self, points: int) -> float:
        """Return the length of `points` steps [s], for FMI's calls: the nearest floating point number."""
        return points * self.numerator / (self.denominator * 10**9)
