"""Groups of array rows: runs of equal rows in sorted columns."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


def new_group(*columns: NDArray[np.integer[Any]]) -> NDArray[np.bool_]:
    """Mask of the rows that differ from the one before in any column, and of the first row."""
    starts = np.zeros(columns[0].size, dtype=np.bool_)
    starts[:1] = True
    for column in columns:
        starts[1:] |= column[1:] != column[:-1]
    return starts


def largest_so_far(group: Ints, values: Ints) -> Ints:
    """The running maximum of `values` within each group. Rows with equal values of `group` are adjacent."""
    starts = new_group(group)
    if not ((values[1:] < values[:-1]) & ~starts[1:]).any():
        return values
    # ranks replace the values, so that the offset between groups is below rows squared, however large the values are
    order = np.argsort(values, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(order.size)
    apart = np.cumsum(starts) * order.size
    largest: Ints = values[order[np.maximum.accumulate(apart + rank) - apart]]
    return largest
