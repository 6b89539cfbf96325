"""A multilayer perceptron with one hidden layer, fitted exactly at one point at a time (section 5.3: 100 neurons).

    V(x) = b + sum over k of w_k tanh(a_k . x / C_x + c_k)

`fit` moves all parameters along the gradient of V at x, the least change that gives the value there to first order, and
repeats until V(x) is the value.
"""

from __future__ import annotations

import numpy as np

from agents.optimal_triggering.held_loop import Floats
from agents.optimal_triggering.online import C_X

FITTED = 1e-9               # relative
MOST = 50


class Perceptron:
    def __init__(self, rng: np.random.Generator, level: float = 0.0, hidden: int = 100) -> None:
        """Start near the constant `level`."""
        self._a = rng.normal(size=(hidden, 3)) * 2
        self._c = rng.normal(size=hidden)
        self._w = rng.normal(size=hidden) / np.sqrt(hidden)
        self._b = level

    def __call__(self, x: Floats) -> Floats:
        value: Floats = self._b + self._w @ np.tanh(self._a @ (x / C_X[:, None]) + self._c[:, None])
        return value

    def fit(self, x: Floats, value: float) -> None:
        scaled = x / C_X
        for _ in range(MOST):
            active = np.tanh(self._a @ scaled + self._c)
            missing = value - (self._b + float(self._w @ active))
            if abs(missing) <= FITTED * (1 + abs(value)):
                return
            inner = self._w * (1 - active ** 2)                     # by c; times x by a
            size = float(active @ active + 1 + (inner @ inner) * (1 + scaled @ scaled))
            step = missing / size
            self._a += step * inner[:, None] * scaled
            self._c += step * inner
            self._w += step * active
            self._b += step
