"""Statistics of the samples of one signal, each one number, as `[expect]` names them.

    min <= mean <= max     rms <= abs_max        also where rounding or the size of the values would break it

Samples are float64. One that is no number makes every statistic nan, as first and last where it stands there.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
LEAST_SIZE, LARGEST_SIZE = 1e-100, 1e100


def mean(values: Floats) -> float:
    scale = _scale(values)
    with np.errstate(invalid="ignore"):         # of +inf and -inf
        found = float((values / scale).mean()) * scale
    low, high = float(values.min()), float(values.max())
    return min(max(found, low), high) if found == found else found


def rms(values: Floats) -> float:
    scale = _scale(values)
    return min(float(np.sqrt(np.square(values / scale).mean())) * scale, float(np.abs(values).max()))


def _scale(values: Floats) -> float:
    """1, or the largest size of a value where sums of squares would leave the range of float64."""
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
