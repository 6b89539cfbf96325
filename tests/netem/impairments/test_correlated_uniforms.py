from __future__ import annotations

from math import asin, exp, pi, sin

import numpy as np
import pytest
from scipy import stats

from netem.core.random_streams import stream
from netem.impairments.correlated_uniforms import LARGEST, correlated_uniforms

SIGNIFICANCE = 1e-3
correlations = pytest.mark.parametrize("correlation", [-0.7, 0.3, 0.9])


@correlations
def test_draws_stay_exactly_uniform(correlation):
    rho = 2 * sin(pi * correlation / 6)
    apart = int(np.ceil(np.log(1e-3) / np.log(abs(rho))))       # steps after which 0.001 of the correlation is left
    draw = correlated_uniforms(stream(7, "copula"), correlation)

    u = [draw() for _ in range(1500 * apart)][::apart]

    assert stats.kstest(u, "uniform").pvalue > SIGNIFICANCE


@correlations
def test_lag_one_rank_correlation_is_the_one_asked_for(correlation):
    runs, length = 40, 1000

    found = []
    for run in range(runs):
        draw = correlated_uniforms(stream(run, "copula"), correlation)
        u = [draw() for _ in range(length)]
        found.append(stats.spearmanr(u[1:], u[:-1]).statistic)

    bias = (1 + 4 * abs(correlation)) / length                  # of a lag-1 correlation: Kendall 1954, first order
    assert abs(np.mean(found) - correlation) < bias + 4 * np.std(found, ddof=1) / runs ** 0.5


def test_lag_two_correlation_decays_as_an_ar1_process():
    runs, length, rho = 40, 1000, 2 * sin(pi * 0.8 / 6)

    found = []
    for run in range(runs):
        draw = correlated_uniforms(stream(run, "copula"), 0.8)
        u = [draw() for _ in range(length)]
        found.append(stats.spearmanr(u[2:], u[:-2]).statistic)

    expected = 6 / pi * asin(rho ** 2 / 2)
    assert abs(np.mean(found) - expected) < 5 / length + 4 * np.std(found, ddof=1) / runs ** 0.5


def test_without_correlation_the_generator_itself_draws():
    rng = stream(7, "copula")

    assert correlated_uniforms(rng, 0.0) == rng.random


class Extreme:
    def __init__(self, value):
        self.random = lambda: value


@pytest.mark.parametrize("value", [0.0, LARGEST, exp(-700)])
def test_the_generators_extremes_stay_inside_the_unit_interval(value):
    draw = correlated_uniforms(Extreme(value), 0.999)

    assert all(0 <= draw() < 1 for _ in range(50))


@pytest.mark.parametrize("correlation", [-1, 1, float("nan")])
def test_a_correlation_of_one_is_refused(correlation):
    with pytest.raises(ValueError, match="expected -1 < correlation < 1"):
        correlated_uniforms(stream(7, "copula"), correlation)
