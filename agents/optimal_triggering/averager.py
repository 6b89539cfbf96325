"""Averagers: the value at a state is a convex combination of the values at fixed points of C_x (Gordon 1995).

    V(x) = sum over i of w_i(x) V(x_i),     w_i >= 0,     sum w_i = 1

so ||V - W|| never grows from the points to C_x, and value iteration with an averager contracts as the Bellman operator
does. A member of this kind answers one question: which points, with which weights.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from agents.optimal_triggering.held_loop import Floats


class Combination(NamedTuple):
    points: NDArray[np.intp]        # shape (k, n): the points that the values of n states are made of
    weights: Floats                 # shape (k, n), columns sum to 1


class Averager(Protocol):
    points: Floats                  # shape (3, points)

    def combine(self, x: Floats) -> Combination:
        """Return the combinations for states x of shape (3, n); a state outside C_x is clamped to it."""


class Grid:
    """Multilinear interpolation on a rectangular grid, whose axes need not be uniform."""

    def __init__(self, *axes: Floats) -> None:
        for axis in axes:
            if axis.ndim != 1 or axis.size < 2 or not (np.diff(axis) > 0).all():
                raise ValueError(f"axis {axis}: expected at least 2 numbers, each larger than the one before")
        self.axes = axes
        self.shape = tuple(axis.size for axis in axes)
        self.points: Floats = np.stack([each.ravel() for each in np.meshgrid(*axes, indexing="ij")])

    def combine(self, x: Floats) -> Combination:
        points, weights = np.zeros((1, x.shape[1]), dtype=np.intp), np.ones((1, x.shape[1]))
        for axis, values in zip(self.axes, x, strict=True):
            clamped = np.clip(values, axis[0], axis[-1])
            below = np.clip(np.searchsorted(axis, clamped, side="right") - 1, 0, axis.size - 2)
            share = (clamped - axis[below]) / (axis[below + 1] - axis[below])
            points = np.concatenate([points * axis.size + below, points * axis.size + below + 1])
            weights = np.concatenate([weights * (1 - share), weights * share])
        return Combination(points, weights)


class NearestNeighbours:
    """The k nearest points, weighted by the inverse of their distance; `scale` makes components comparable."""

    def __init__(self, points: Floats, neighbours: int = 4,
                 scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> None:
        if not 1 <= neighbours <= points.shape[1]:
            raise ValueError(f"neighbours={neighbours}: expected 1 to {points.shape[1]}, the number of points")
        self.points, self._k = points, neighbours
        self._scale = np.array(scale)[:, None]
        self._tree = cKDTree((points / self._scale).T)

    def combine(self, x: Floats) -> Combination:
        away, found = self._tree.query((x / self._scale).T, k=[*range(1, self._k + 1)])
        weights = 1 / np.maximum(away, 1e-12)
        return Combination(np.asarray(found, dtype=np.intp).T, (weights / weights.sum(axis=1, keepdims=True)).T)


def symmetric(*positive: float) -> Floats:
    """Return an axis with 0, the numbers given and their negatives."""
    return np.array([*(-value for value in reversed(positive)), 0.0, *positive])


def values(averager: Averager, at_points: Floats, x: Floats) -> Floats:
    """Return V at states x of shape (3, n) from its values at the averager's points."""
    found = averager.combine(x)
    combined: Floats = (at_points[found.points] * found.weights).sum(axis=0)
    return combined
