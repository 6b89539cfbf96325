"""Statistics of the samples of one signal, by the names that `[expect]` uses; each is one number.

    min <= mean <= max     rms <= abs_max        for all samples, in spite of rounding and overflow

Samples are float64. A nan among them makes every statistic nan, but first and last only if it is that sample.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
LEAST_SIZE, LARGEST_SIZE = 1e-100, 1e100


def mean(values: Floats) -> float:
    scale = _scale(values)
    with np.errstate(invalid="ignore"):         # mean of +inf and -inf
        found = float((values / scale).mean()) * scale
    low, high = float(values.min()), float(values.max())
    return min(max(found, low), high) if found == found else found


def rms(values: Floats) -> float:
    scale = _scale(values)
    return min(float(np.sqrt(np.square(values / scale).mean())) * scale, float(np.abs(values).max()))


def _scale(values: Floats) -> float:
    """The largest absolute value if sums of squares would leave the range of float64, otherwise 1."""
    largest = float(np.abs(values).max())
    return largest if 0 < largest < LEAST_SIZE or LARGEST_SIZE < largest < np.inf else 1.0


STATISTIC: dict[str, Callable[[Floats], float]] = {
    "first": lambda values: float(values[0]),
    "last": lambda values: float(values[-1]),
    "last_abs": lambda values: abs(float(values[-1])),
    "min": lambda values: float(values.min()),
    "max": lambda values: float(values.max()),
    "abs_max": lambda values: float(np.abs(values).max()),
    "mean": mean,
    "rms": rms,
}
