"""Looks at floor(i p) T_s, i = 0, 1, ..., whatever is detected; p = N / n, a fraction, makes n looks in N instants."""

from __future__ import annotations

from fractions import Fraction
from math import ceil, floor

from agents.pursuit import Place
from agents.pursuit.sampling import FIRST_LOOKS, check_step


class Periodic:
    def __init__(self, step_ns: int, period_steps: Fraction | int, first_looks: int = FIRST_LOOKS) -> None:
        check_step(step_ns)
        if period_steps < 1:
            raise ValueError(f"period_steps={period_steps}: expected 1 or more; there is no instant in between")
        self._step_ns = step_ns
        self._period = Fraction(period_steps)
        self._first_looks = first_looks

    def asked(self, look_ns: int) -> None:
        self._first_looks -= 1

    def detected(self, seen_ns: int, place: Place, surprised: bool) -> None:
        pass

    def next_look_ns(self, now_ns: int, own: Place) -> int:
        soonest = now_ns // self._step_ns + 1
        if self._first_looks > 0:
            return soonest * self._step_ns
        return floor(ceil(soonest / self._period) * self._period) * self._step_ns
