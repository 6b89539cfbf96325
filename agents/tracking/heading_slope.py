"""The entry (1, 3) of the least valid bound A, the growth of e1 per |e3| (repair of (4.47)).

With e1 = e2 = 0 and phi = x3 + e3 the first row of (4.25) requires of a13, for all e3 and all |x2| <= M2, |x3| <= M3,

    |v (cos phi - cos x3) - k3 x2 e3 - k2 v sinc(phi) x2^2| - k2 |v| x2^2 <= a13 |e3|

(the terms of y~ with x1 can take either sign and drop out). The worst sign of x2 gives

    a13 = max_{0 <= z <= M2} k3 z + |v| D(k2 z^2, M3)
    D(Q, M3) = max_{0 <= x3 <= M3, x3 < phi <= pi} (cos x3 - cos phi - Q (1 - sinc phi)) / (phi - x3),  at least 0

phi in (x3, pi] suffices: to any other pair there is one in it with equal cosines, no larger distance and no smaller
sinc. D does not depend on the gains. It is nonincreasing and convex in Q (a maximum of falling lines), 0 from Q = 3 on,
nondecreasing in M3 and constant from pi/2 on. So a table that rounds M3 up and takes the chord in Q is valid.

Invariants:
- `__call__` is never below a13, and above it by less than 1 % of the closed form |v| + k3 M2;
- it is never above the closed form.
"""

from __future__ import annotations

from functools import cache
from math import ceil, pi, sqrt

VANISHES_AT = 3.0       # D(Q) = 0 for Q >= 3, since 1 - cos phi <= 3 (1 - sinc phi)
CELLS = 32              # cells of Q, equal steps of sqrt(Q)
ROWS = 64               # rows of M3 in (0, pi/2], besides row 0
FINER = 4               # grid points of x3 per row
STEPS = 400             # grid points of phi
GRID_ERROR = 2e-5       # bound of D minus its value on the grid: 5e-6 compared with a grid ten times finer


def load_library() -> None:
    """Import NumPy now, so that `heading_table` need not import it later in each process."""
    import numpy  # noqa: F401


@cache
def heading_table() -> tuple[tuple[float, ...], ...]:
    """Return D at M3 = i (pi/2) / ROWS, Q = 3 (j / CELLS)^2, raised by GRID_ERROR; takes 10 ms, once per process."""
    import numpy as np  # here: a check that computes no slope does not need NumPy

    x3 = np.linspace(0, pi / 2, ROWS * FINER + 1)[:, None]
    e3 = (pi - x3) * np.linspace(0, 1, STEPS + 1)[1:]
    slope = (np.cos(x3) - np.cos(x3 + e3)) / e3
    fall = (1 - np.sinc((x3 + e3) / pi)) / e3
    columns = []
    for Q in VANISHES_AT * (np.arange(CELLS) / CELLS) ** 2:
        best = np.maximum.accumulate((slope - Q * fall).max(axis=1))[::FINER]
        columns.append(np.minimum(best + GRID_ERROR, 1.0))
    columns.append(np.zeros(ROWS + 1))
    return tuple(tuple(row) for row in np.stack(columns, axis=1).tolist())


class HeadingSlope:
    """a13 for one pair of controller gains."""

    def __init__(self, k2_per_m2: float, k3_per_s: float) -> None:
        self._k3 = k3_per_s
        self._table = heading_table()
        self.step_m = sqrt(VANISHES_AT / k2_per_m2) / CELLS
        self._at_node = tuple(k3_per_s * j * self.step_m for j in range(CELLS + 1))
        # Between two nodes k3 z + |v| (chord in Q) is a parabola that exceeds its ends by at most |v| fall step^2 / 4.
        fall = max((row[j] - row[j + 1]) / (2 * j + 1) for row in self._table for j in range(CELLS))
        self.bump = fall / 4

    def __call__(self, v_mps: float, m2_m: float, m3_rad: float) -> float:
        """Return a13 [1/s] for v_mps = |v_R2| >= 0, M2 and M3."""
        row = self._table[min(ceil(m3_rad * (2 * ROWS / pi)), ROWS)]
        k3 = self._k3
        largest = k3 * m2_m
        place = m2_m / self.step_m
        if place < CELLS:
            n = int(place)
            share = (place * place - n * n) / (2 * n + 1)
            largest += v_mps * (row[n] + (row[n + 1] - row[n]) * share)
            last = n + 1
        else:
            last = CELLS
        for at, slope in zip(self._at_node[:last], row, strict=False):
            here = at + v_mps * slope
            if here > largest:
                largest = here
        return min(largest + v_mps * self.bump, v_mps + k3 * m2_m)
