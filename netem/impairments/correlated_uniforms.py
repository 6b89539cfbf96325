"""Uniform draws of which successive ones are correlated and each is exactly uniform: a Gaussian copula.

    z[k] = rho z[k-1] + sqrt(1 - rho^2) e[k],  e[k] = Phi^-1(random()),  z[0] = e[0]      standard normal at every k
    u[k] = Phi(z[k])                                                                      uniform on (0, 1)
    rho = 2 sin(pi r / 6), where r is the rank (Spearman) correlation of u[k-1] and u[k]  (Pearson 1907)

Any quantile function keeps ranks, so a delay Q(u[k]) has exactly Q's distribution and lag-1 rank correlation r.
Across k the correlation decays as an AR(1) process: the underlying normals have rho^m at lag m.

Differs from Linux netem: its generator mixes r u[k-1] + (1 - r) random(), which reduces the variance to (1-r)/(1+r) of
the uniform distribution's and so shifts every loss ratio and every delay that is drawn with it.
"""

from __future__ import annotations

from collections.abc import Callable
from math import erfc, pi, sin, sqrt
from random import Random
from statistics import NormalDist

from netem.impairments.checks import expect_correlation

SMALLEST = 2.0 ** -54               # random() may give 0, whose normal quantile is -infinity; its grid is 2^-53
LARGEST = 1 - 2.0 ** -53

normal_quantile: Callable[[float], float] = NormalDist().inv_cdf


def correlated_uniforms(rng: Random, correlation: float) -> Callable[[], float]:
    """Return a function that draws the next u in [0, 1); with `correlation` 0 it is `rng.random` itself."""
    expect_correlation(correlation)
    if correlation == 0:
        return rng.random
    rho = 2 * sin(pi * correlation / 6)
    fresh = sqrt(1 - rho * rho)
    z: float | None = None

    def draw() -> float:
        nonlocal z
        e = normal_quantile(rng.random() or SMALLEST)
        z = e if z is None else rho * z + fresh * e
        return min(0.5 * erfc(-z / sqrt(2)), LARGEST)

    return draw
