"""The distance of a servo from its reference, as a derived signal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def difference(reference: NDArray[np.float64], position: NDArray[np.float64]) -> NDArray[np.float64]:
    return reference - position
