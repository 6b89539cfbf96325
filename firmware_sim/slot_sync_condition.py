"""Does resynchronization bring the clocks together, and how fast? The round's map and its eigenvalues.

With L = I - A (row i of A averages over those whom i hears; the row of a reference, or of a node that hears nobody, is
zero), x the offsets and v = round * (drift + trims) how far each clock runs off in a round, one round of `SlotSync` is

    x <- x - gain L x + v',   v <- v' = v - rate_gain gain L x

Along an eigenvector of L with eigenvalue l the 2 x 2 map has the characteristic polynomial

    z^2 - (2 - gain l (1 + rate_gain)) z + (1 - gain l)          without rate_gain: z = 1 - gain l

The differences between clocks die out iff 0 is a simple eigenvalue of L (somebody is heard by all, directly or not) and
all these z, l != 0, lie inside the unit circle. For real l <= 2 that is gain l (2 + rate_gain) < 4 (Jury); complex l,
from one-way links, allow less.

Source: Carli, Chiuso, Schenato & Zampieri, IFAC World Congress 2008; Jury's test.
Not modelled: the bound on a step, the median, lost frames, rounds that are closed at one's own slot.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np


def contraction_per_round(hears: Mapping[str, Collection[str]], gain: float, rate_gain: float = 0.0,
                          references: Collection[str] = ()) -> float:
    """The factor by which differences between clocks shrink per round in the long run; 1 or more: they do not."""
    names = list(hears)
    place = {name: i for i, name in enumerate(names)}
    L = np.zeros((len(names), len(names)))
    for name, heard in hears.items():
        if name in references or not heard:
            continue
        L[place[name], place[name]] = 1.0
        for sender in heard:
            L[place[name], place[sender]] -= 1 / len(heard)
    eigenvalues = sorted(np.linalg.eigvals(L), key=abs)
    roots = len(names) - int(np.linalg.matrix_rank(L))
    if roots > 1:
        return 1.0
    return max((_largest_root(gain * complex(value), rate_gain) for value in eigenvalues[1:]), default=0.0)


def _largest_root(gl: complex, rate_gain: float) -> float:
    if rate_gain == 0:
        return abs(1 - gl)
    return float(max(abs(np.roots([1, -(2 - gl * (1 + rate_gain)), 1 - gl]))))
