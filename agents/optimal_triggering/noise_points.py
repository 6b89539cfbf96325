"""Quadrature points for E over e_omega and nu, uniform in boxes: states of a look are averaged over these.

    simpson(a)        3 x 3 points {-a, 0, a}^2, weights (1, 4, 1)/6 in each direction: exact to degree 3, as printed
    cubature(...)     2 n points +-sqrt(n) sigma e_k in n = 5 dimensions (nu, e_omega): exact to degree 3 as well, with
                      10 points where the tensor product of Simpson's formula has 243

e_omega changes within an interval: it is linear between independent values `knot_s` apart. Over an interval its mean
has the variance sigma^2 min(1, knot_s / tau), approximately; the table holds a constant e_omega of that variance.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from agents.optimal_triggering.held_loop import Floats


class NoisePoints(NamedTuple):
    nu: Floats              # shape (3, points)
    e_omega: Floats         # shape (2, points)
    weights: Floats         # sum to 1


NO_NOISE = NoisePoints(np.zeros((3, 1)), np.zeros((2, 1)), np.ones(1))


def simpson(inputs: float) -> NoisePoints:
    """Return Simpson's points for e_omega uniform in [-inputs, inputs]^2, without nu."""
    place, share = np.array([-inputs, 0.0, inputs]), np.array([1.0, 4.0, 1.0]) / 6
    both = np.stack([each.ravel() for each in np.meshgrid(place, place, indexing="ij")])
    return NoisePoints(np.zeros((3, 9)), both, np.outer(share, share).ravel())


def cubature(measured: float, inputs: float) -> NoisePoints:
    """Return points for nu uniform in [-measured, measured]^3 and e_omega uniform in [-inputs, inputs]^2."""
    sigmas = np.array([measured] * 3 + [inputs] * 2) / np.sqrt(3)
    points = np.sqrt(5) * np.concatenate([np.diag(sigmas), -np.diag(sigmas)], axis=1)
    return NoisePoints(points[:3], points[3:], np.full(10, 0.1))


def held_share(tau_s: Floats, knot_s: float) -> Floats:
    """Return the factor by which e_omega shrinks when its mean over tau_s stands for it."""
    return np.sqrt(np.minimum(1.0, knot_s / np.maximum(tau_s, 1e-12)))
