"""A network of kernels of compact support: each fit adds one, so that V changes nowhere else (properties (i), (ii)).

    V(x) = level + sum over k of w_k phi(|x - x_k| / radius),     phi(r) = (1 - r)^4 (4 r + 1) for r < 1, else 0

distances in units of C_x. phi is Wendland's function of smoothness 2 (1995); phi(0) = 1, so the newest kernel's weight
is the difference at its centre.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist

from agents.optimal_triggering.held_loop import Floats
from agents.optimal_triggering.online import C_X


class KernelNetwork:
    def __init__(self, level: float = 0.0, radius: float = 0.5) -> None:
        if not radius > 0:
            raise ValueError(f"radius={radius}: expected more than 0, as a share of C_x")
        self._level, self._radius = level, radius
        self._centres: Floats = np.zeros((0, 3))
        self._weights: Floats = np.zeros(0)

    def __call__(self, x: Floats) -> Floats:
        value = np.full(x.shape[1], self._level)
        if self._weights.size:
            value += self._kernel(x) @ self._weights
        return value

    def fit(self, x: Floats, value: float) -> None:
        missing = value - float(self(x[:, None])[0])
        self._centres = np.concatenate([self._centres, (x / C_X)[None]])
        self._weights = np.append(self._weights, missing)

    def _kernel(self, x: Floats) -> Floats:
        r = np.minimum(cdist((x / C_X[:, None]).T, self._centres) / self._radius, 1.0)
        kernel: Floats = (1 - r) ** 4 * (4 * r + 1)
        return kernel
