"""The instants at which a time-based input clock of FMI 3.0 ticks.

    constant, fixed     t_k = shift + k interval, computed from k, so that it does not drift
    tunable             shift, then each time the interval in force after the last tick
    changing            shift, then the interval that the FMU tells at each tick
    countdown           the instant at which the FMU tells an interval, plus that interval; else no tick

Instants are rounded to the nearest nanosecond. Source: FMI 3.0.2, section 2.2.8, table of `intervalVariability`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction

from fmus.description import Variable

NS_PER_S = 10**9


def in_ns(seconds: Fraction) -> int:
    """Return the nearest whole nanosecond, a half rounded up."""
    return (2 * NS_PER_S * seconds.numerator + seconds.denominator) // (2 * seconds.denominator)


@dataclass
class TimedClock:
    """`due_ns` is the next tick; None while none is known. Raises ValueError for a period below 1 ns."""

    variable: Variable
    interval_s: Fraction | None = None
    due_ns: int | None = None
    _shift_s: Fraction = Fraction(0)
    _ticks: int = 0
    _last_ns: int = 0
    variability: str = field(default="", init=False)

    def __post_init__(self) -> None:
        clock = self.variable.clock
        assert clock is not None
        self.variability = clock.variability
        self._shift_s = Fraction(*clock.shift)
        if clock.interval is not None:
            self._set_period(Fraction(*clock.interval))
        if self.variability != "countdown":
            self.due_ns = in_ns(self._shift_s)

    def may_change(self, ticked: bool) -> bool:
        """Return whether its interval may have changed in an event, in which it `ticked` or not."""
        return self.variability in ("tunable", "countdown") or (ticked and self.variability == "changing") \
            or not self.interval_s_known

    @property
    def interval_s_known(self) -> bool:
        """False for a periodic clock whose interval the FMU has not told yet: it does not tick so far."""
        return self.interval_s is not None or self.variability in ("changing", "countdown")

    def told(self, interval_s: Fraction, now_ns: int) -> None:
        """Take the interval that the FMU tells at `now_ns`."""
        if self.variability == "countdown":
            self.due_ns = now_ns + in_ns(interval_s)
        elif self.variability == "changing":
            self.interval_s = interval_s
            self.due_ns = self._last_ns + in_ns(interval_s)
        else:
            self._set_period(interval_s)
            if self.variability == "tunable" and self._ticks:
                self.due_ns = max(now_ns, self._last_ns + in_ns(interval_s))

    def ticked(self, now_ns: int) -> None:
        self._ticks += 1
        self._last_ns = now_ns
        if self.variability in ("changing", "countdown") or self.interval_s is None:
            self.due_ns = None
        elif self.variability == "tunable":
            self.due_ns = now_ns + in_ns(self.interval_s)
        else:
            self.due_ns = in_ns(self._shift_s + self._ticks * self.interval_s)

    def _set_period(self, interval_s: Fraction) -> None:
        if in_ns(interval_s) < 1:
            raise ValueError(f"clock {self.variable.name}: its interval is {float(interval_s):g} s: expected at least "
                             "1 ns, the resolution of simulated time")
        self.interval_s = interval_s
