"""Distributions of a random delay as quantile functions: they map u in (0, 1) to a deviation in units of the jitter.

    uniform       2u - 1                                          within +-1
    normal        Phi^-1(u)                                       standard deviation 1
    pareto        ((1 - u)^(-1/3) - 3/2) / (sqrt(3)/2)            shape 3, shifted and scaled to mean 0, deviation 1
    paretonormal  (normal(u) + 3 pareto(u)) / 4                   mean 0, deviation 0.9378

Shape 3 and the mixture, 1:3 of quantiles at the same u, are those of Linux netem's tables.

Differs from Linux netem: its Pareto table is scaled by 4/3 and cut at 4, so its mean is -0.03 and its deviation 0.82;
here the jitter is the standard deviation and no tail is cut. Its tables have 4096 steps; here quantiles are continuous.
"""

from __future__ import annotations

from array import array
from bisect import bisect_right
from collections.abc import Callable, Sequence
from math import sqrt

from netem.impairments.correlated_uniforms import SMALLEST, normal_quantile

Quantile = Callable[[float], float]


def uniform(u: float) -> float:
    return 2 * u - 1


def normal(u: float) -> float:
    return normal_quantile(u or SMALLEST)


def pareto(u: float) -> float:
    return float((1 - u) ** (-1 / 3) - 1.5) / (sqrt(3) / 2)


def paretonormal(u: float) -> float:
    return (normal(u) + 3 * pareto(u)) / 4


JITTER_QUANTILES: dict[str, Quantile] = {
    "uniform": uniform,
    "normal": normal,
    "pareto": pareto,
    "paretonormal": paretonormal,
}


def of_samples(samples_ns: Sequence[int]) -> Quantile:
    """Quantile function of the empirical distribution, in ns: each sample is equally likely."""
    ordered = array("q", sorted(samples_ns))
    return lambda u: ordered[int(u * len(ordered))]


def of_points(probabilities: Sequence[float], quantiles_ns: Sequence[int]) -> Quantile:
    """Quantile function that is linear between (probability, quantile) points, in ns.

    The probabilities rise strictly from 0 to 1.
    """
    last = len(probabilities) - 2

    def quantile(u: float) -> float:
        i = min(bisect_right(probabilities, u) - 1, last)
        share = (u - probabilities[i]) / (probabilities[i + 1] - probabilities[i])
        return quantiles_ns[i] + share * (quantiles_ns[i + 1] - quantiles_ns[i])

    return quantile
