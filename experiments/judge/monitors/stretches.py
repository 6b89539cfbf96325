"""Joins intervals of time [start, end) that touch or overlap."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from experiments.judge.groups import Ints, largest_so_far, new_group


def joined(subject: Ints, start: Ints, end: Ints) -> Ints:
    """Return the indices of the rows, sorted by (subject, start), at which a joined interval begins.

    Joined interval k lasts from start[found[k]] to the largest end before row found[k + 1].
    """
    if not subject.size:
        return np.zeros(0, dtype=np.int64)
    first = new_group(subject)
    reached = largest_so_far(subject, end)
    first[1:] |= start[1:] > reached[:-1]
    return np.flatnonzero(first)


def covered_ns(stretches: Sequence[tuple[int, int]]) -> int:
    """Length of the union of the intervals."""
    total, reached = 0, -1
    for start, end in sorted(stretches):
        total += max(0, end - max(start, reached))
        reached = max(reached, end)
    return total
