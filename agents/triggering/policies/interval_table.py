"""Intervals by state, made before a run: tau* and its cap on a rectangular grid, a table for each value of the inputs.

Between grid points tau* is interpolated linearly in each component; the cap is the least of the cell's eight corners,
so that an interval never exceeds what any of them allows. A state outside the grid is clamped to it. Written in plain
floats: a robot asks once a look, and NumPy would cost more than the arithmetic.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple


class Interval(NamedTuple):
    tau_s: float
    cap_s: float
    clamped: bool           # True: the state is outside the grid


class IntervalTable:
    def __init__(self, axes: Sequence[Sequence[float]], tau_s: Sequence[float], cap_s: Sequence[float],
                 shortest_s: float) -> None:
        """Take values in the order of the axes, the last one fastest; ValueError for a cap below `shortest_s`."""
        self._axes = [list(axis) for axis in axes]
        if len(self._axes) != 3 or any(len(axis) < 2 or any(a >= b for a, b in pairwise(axis)) for axis in self._axes):
            raise ValueError("axes: expected three lists of at least 2 ascending numbers")
        count = len(self._axes[0]) * len(self._axes[1]) * len(self._axes[2])
        if len(tau_s) != count or len(cap_s) != count:
            raise ValueError(f"tau_s, cap_s: {len(tau_s)} and {len(cap_s)} values: expected {count}, one a point")
        if not 0 < shortest_s <= min(cap_s):
            raise ValueError(f"shortest_s={shortest_s:g}: expected more than 0 and at most the least cap, "
                             f"{min(cap_s):.6g} s; a cap below the shortest interval leaves no choice")
        self._tau_s, self._cap_s, self._shortest_s = list(tau_s), list(cap_s), shortest_s
        self._stride1 = len(self._axes[2])
        self._stride0 = self._stride1 * len(self._axes[1])

    def look_up(self, x: Sequence[float]) -> Interval:
        """Return tau* in [shortest_s, cap], and the cap; ValueError for a state that is no number."""
        x1, x2, x3 = x
        if not (x1 - x1 == 0 and x2 - x2 == 0 and x3 - x3 == 0):
            raise ValueError(f"x=({x1:.9g}, {x2:.9g}, {x3:.9g}): no tracking error [m, m, rad]; leave such a "
                             "measurement out")
        axis0, axis1, axis2 = self._axes
        i, a, out0 = _cell(axis0, x1)
        j, b, out1 = _cell(axis1, x2)
        k, c, out2 = _cell(axis2, x3)
        tau, cap = self._tau_s, self._cap_s
        n00 = i * self._stride0 + j * self._stride1 + k
        n01 = n00 + self._stride1
        n10 = n00 + self._stride0
        n11 = n10 + self._stride1
        a0, b0, c0 = 1 - a, 1 - b, 1 - c
        found = (a0 * (b0 * (c0 * tau[n00] + c * tau[n00 + 1]) + b * (c0 * tau[n01] + c * tau[n01 + 1]))
                 + a * (b0 * (c0 * tau[n10] + c * tau[n10 + 1]) + b * (c0 * tau[n11] + c * tau[n11 + 1])))
        least = min(cap[n00], cap[n00 + 1], cap[n01], cap[n01 + 1], cap[n10], cap[n10 + 1], cap[n11], cap[n11 + 1])
        return Interval(min(max(found, self._shortest_s), least), least, out0 or out1 or out2)


def _cell(axis: list[float], value: float) -> tuple[int, float, bool]:
    """Return the cell, the place in it from 0 to 1, and whether the value had to be clamped."""
    if value <= axis[0]:
        return 0, 0.0, value < axis[0]
    if value >= axis[-1]:
        return len(axis) - 2, 1.0, value > axis[-1]
    k = bisect_right(axis, value) - 1
    return k, (value - axis[k]) / (axis[k + 1] - axis[k]), False
