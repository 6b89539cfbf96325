"""How far a target comes that turns at random: n legs of length d, headings independent and uniform within +-pi/2.

    A_n = sum d sin(phi_i)   across the bisector     E = 0             Var = n d^2 / 2
    B_n = sum d cos(phi_i)   along the bisector      E = 2 n d / pi    Var = n d^2 (pi^2 - 8) / (2 pi^2)

Differs from the dissertation: the proof of Proposition 1 prints d instead of d^2 in both variances, and takes sine and
cosine of angles from the x axis; here phi is the angle from the bisector.

Not modelled: obstacles, legs of unequal length. With legs of uniform duration the mean duration is meant.
"""

from __future__ import annotations

from math import isfinite, pi, sqrt
from statistics import NormalDist
from typing import NamedTuple

MEAN_ADVANCE = 2.0 / pi                                             # of one leg of length 1 along the bisector
ADVANCE_VARIANCE = (pi ** 2 - 8.0) / (2.0 * pi ** 2)
ACROSS_VARIANCE = 0.5


class Moments(NamedTuple):
    mean_m: float
    variance_m2: float


def along_bisector(legs: int, leg_m: float) -> Moments:
    """Return mean and variance of B_n, how far a target has come along the bisector."""
    return Moments(legs * leg_m * MEAN_ADVANCE, legs * leg_m ** 2 * ADVANCE_VARIANCE)


def across_bisector(legs: int, leg_m: float) -> Moments:
    """Return mean and variance of A_n, how far a target has come across the bisector."""
    return Moments(0.0, legs * leg_m ** 2 * ACROSS_VARIANCE)


def longest_stay_s(depth_m: float, slowest_mps: float, leg_s: float, confidence: float = 0.99) -> float:
    """Return the time [s] after which a target has come `depth_m` along the bisector with probability `confidence`.

    Use it to end an investigation: `depth_m` is the C-target's depth, `slowest_mps` the least speed of a target and
    `leg_s` the mean time between two turns. B_n of n = t / leg_s legs is taken as normal, with at least one leg:

        2 n / pi - z sqrt(n (pi^2 - 8) / (2 pi^2)) = depth / d,   d = slowest * leg_s,   z: quantile of `confidence`

    No finite time is certain: a target that always draws headings near +-pi/2 never advances.
    Differs from the dissertation: Figure 2.3 never ends an investigation that finds nothing."""
    for name, value in (("slowest_mps", slowest_mps), ("leg_s", leg_s)):
        if not (isfinite(value) and value > 0):
            raise ValueError(f"{name}={value}: expected more than 0")
    if not (isfinite(depth_m) and depth_m >= 0):
        raise ValueError(f"depth_m={depth_m}: expected 0 or more")
    if not 0.5 <= confidence < 1:
        raise ValueError(f"confidence={confidence}: expected 0.5 <= confidence < 1, as 0.99")
    spread = NormalDist().inv_cdf(confidence) * sqrt(ADVANCE_VARIANCE)
    root = (spread + sqrt(spread ** 2 + 4.0 * MEAN_ADVANCE * depth_m / (slowest_mps * leg_s))) / (2.0 * MEAN_ADVANCE)
    return max(1.0, root ** 2) * leg_s
