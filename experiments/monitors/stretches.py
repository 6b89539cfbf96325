"""Stretches of time [start, end) that touch or overlap, joined into the longest ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


def joined(subject: Ints, start: Ints, end: Ints) -> Ints:
    """Where a new stretch begins: indices into rows that are sorted by (subject, start).

    Stretch k runs from start[found[k]] to the largest end before row found[k + 1].
    """
    if not subject.size:
        return np.zeros(0, dtype=np.int64)
    first = np.r_[True, subject[1:] != subject[:-1]]
    # the largest end so far within the subject: subjects are kept apart by a distance that no time reaches
    apart = np.cumsum(first) * (int(end.max()) - int(start.min()) + 1)
    reached = np.maximum.accumulate(end + apart)
    first[1:] |= start[1:] + apart[1:] > reached[:-1]
    return np.flatnonzero(first)


def covered_ns(stretches: Sequence[tuple[int, int]]) -> int:
    """How much time is in at least one of them."""
    total, reached = 0, -1
    for start, end in sorted(stretches):
        total += max(0, end - max(start, reached))
        reached = max(reached, end)
    return total
