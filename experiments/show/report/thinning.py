"""Thins a curve without hiding peaks: keeps the smallest and the largest sample of every stretch, in their order.

The thinned curve has the same vertical extent as the whole curve in every stretch, so a spike of one sample remains;
oscillations within a stretch are lost. First and last sample are kept.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

MOST_POINTS = 5_000


def keep(values: NDArray[np.float64], most: int = MOST_POINTS) -> NDArray[np.intp]:
    """Return the indices of the samples to draw, increasing, at most `most` (>= 4); nan is never an extreme."""
    assert most >= 4, f"most={most}: two ends and one stretch need 4 points"
    count = values.size
    if count <= most:
        return np.arange(count)
    stretches = (most - 2) // 2
    edges = np.linspace(1, count - 1, stretches + 1).astype(np.intp)
    low, high = np.where(np.isnan(values), np.inf, values), np.where(np.isnan(values), -np.inf, values)
    picked = [index for start, end in pairwise(edges) if end > start
              for index in (start + int(low[start:end].argmin()), start + int(high[start:end].argmax()))]
    return np.unique(np.array([0, *picked, count - 1], dtype=np.intp))
