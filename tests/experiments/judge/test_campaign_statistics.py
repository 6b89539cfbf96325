"""Intervals and tests of campaigns against closed forms, and against how often they are right."""

from __future__ import annotations

from math import comb, isnan, nan, sqrt
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import beta

from experiments.judge.campaign import Campaign, Plan, Row
from experiments.judge.campaign_statistics import mean, share
from experiments.judge.difference import HOLDS, differences, holm
from experiments.judge.figures import Figures
from experiments.scenario.model import Bound


@pytest.mark.parametrize(("held", "runs"), [(0, 10), (3, 10), (10, 10), (97, 100)])
def test_the_interval_of_a_share_is_that_of_clopper_and_pearson(held: int, runs: int) -> None:
    found = share(held, runs)

    low = beta.ppf(0.025, held, runs - held + 1) if held else 0.0       # their bounds as quantiles of a beta law
    high = beta.ppf(0.975, held + 1, runs - held) if held < runs else 1.0
    assert (found.low, found.high) == (pytest.approx(low, abs=1e-9), pytest.approx(high, abs=1e-9))
    assert found.value == held / runs


def test_of_no_failure_in_n_runs_the_rule_of_three_follows() -> None:
    assert 1 - (share(1000, 1000).low or 0) == pytest.approx(1 - 0.025 ** (1 / 1000), rel=1e-9)


def test_the_interval_of_a_mean_is_near_that_of_the_normal_law_and_the_same_each_time() -> None:
    values = np.random.default_rng(1).normal(3.0, 2.0, 400).tolist()

    found = mean(values)

    half = 1.96 * float(np.std(values, ddof=1)) / sqrt(400)
    assert found is not None
    assert found.low is not None
    assert found.high is not None
    # a bound of 2000 resamples has a standard error of sqrt(0.025 * 0.975 / 2000) / phi(1.96) = 0.06 sigma of the mean
    assert abs(found.low - (found.value - half)) < 4 * 0.06 * half / 1.96
    assert abs(found.high - (found.value + half)) < 4 * 0.06 * half / 1.96
    assert mean(values) == found


def test_means_without_an_interval_have_none() -> None:
    assert mean([]) is None
    assert mean([2.0]) is not None
    assert (mean([2.0]).low, mean([2.0]).runs) == (None, 1)             # type: ignore[union-attr]
    assert mean([2.0, 2.0, 2.0]).low == 2.0                             # type: ignore[union-attr]
    assert mean([1.0, float("inf")]).low is None                        # type: ignore[union-attr]


def test_p_values_are_adjusted_as_holm_says() -> None:
    # sorted: 0.01 * 4, 0.02 * 3, 0.03 * 2, 0.04 * 1, each at least the one before
    assert holm([0.04, 0.01, nan, 0.03, 0.02])[:2] == [pytest.approx(0.06), pytest.approx(0.04)]
    assert isnan(holm([0.04, nan])[1])
    assert holm([0.9, 0.8]) == [1.0, 1.0]


@given(st.lists(st.floats(0, 1), min_size=1, max_size=8))
def test_adjusted_p_values_keep_the_order_and_lie_between_their_own_and_bonferronis(p_values: list[float]) -> None:
    found = holm(p_values)

    for p, adjusted in zip(p_values, found, strict=True):
        assert min(1.0, p) <= adjusted <= min(1.0, len(p_values) * p) + 1e-12
    order = sorted(range(len(p_values)), key=lambda k: p_values[k])
    assert [found[k] for k in order] == sorted(found)


def campaign(figures: list[tuple[bool, float | None]], first_seed: int = 0) -> Campaign:
    plan = Plan("s", "", "s.toml", "0", None, (), {}, (), ({},), tuple(range(first_seed, first_seed + len(figures))),
                "inline", {"x": Bound(max=1.0)})
    return Campaign(Path("c"), plan, [
        Row(number, 0, Figures(first_seed + number, "h", holds, {"x": value}))
        for number, (holds, value) in enumerate(figures)])


def test_equal_campaigns_do_not_differ() -> None:
    one = campaign([(k % 3 > 0, float(k)) for k in range(30)])

    assert [found.p for found in differences(one, one)] == [1.0, 1.0]


def test_the_verdicts_of_pairs_are_compared_as_mcnemar_says() -> None:
    both, only_a, only_b = [(True, True)] * 20, [(True, False)] * 9, [(False, True)]
    pairs = both + only_a + only_b

    found = differences(*(campaign([(pair[side], 0.0) for pair in pairs]) for side in (0, 1)))[0]

    exact = 2 * (comb(10, 0) + comb(10, 1)) / 2**10             # 1 of 10 pairs that differ, or fewer, on either side
    assert (found.key, found.test) == (HOLDS, "McNemar, pairs")
    assert found.p == pytest.approx(2 * exact)                  # by Holm: of two tests, the smaller counts twice
    assert found.differs


def test_the_verdicts_of_other_runs_are_compared_as_fisher_says() -> None:
    a, b = campaign([(True, None)] * 3 + [(False, None)]), campaign([(True, None)] + [(False, None)] * 3, first_seed=99)

    found = differences(a, b)

    # Fisher's tea: tables with 4 right of 8 have the chances 1, 16, 36, 16, 1 of 70; 34 of them are as extreme as 3, 1
    assert (found[0].test, found[0].p) == ("Fisher", pytest.approx(34 / 70))
    assert isnan(found[1].p)
    assert found[1].missing == 8


def test_the_figures_of_pairs_are_compared_by_all_signs_of_their_differences() -> None:
    a, b = campaign([(True, 0.0)] * 6), campaign([(True, value) for value in (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)])

    found = differences(a, b)[1]

    assert found.p == pytest.approx(2 * 2 / 2**6)               # all of one sign, on either side; by Holm of two tests
    assert found.test == "permutation, pairs"


def test_the_figures_of_other_runs_are_compared_by_all_labels() -> None:
    a = campaign([(True, value) for value in (1.0, 2.0, 3.0)])
    b = campaign([(True, value) for value in (7.0, 8.0, 9.0, 10.0)], first_seed=50)

    found = differences(a, b)[1]

    assert found.p == pytest.approx(min(1.0, 2 * 2 / comb(7, 3)))


@pytest.mark.slow
def test_chance_is_rarely_called_a_difference() -> None:
    rng = np.random.default_rng(4)
    told = 0
    trials = 60
    for _ in range(trials):
        a, b = (campaign([(bool(rng.random() < 0.8), float(rng.exponential())) for _ in range(15)], first_seed=seed)
                for seed in (0, 100))
        told += any(found.differs for found in differences(a, b))

    # the chance of a false alarm is at most 0.05: more than 9 of 60 have a chance of 1e-3 then (binomial)
    assert told <= 9


def test_a_real_difference_is_found() -> None:
    rng = np.random.default_rng(5)
    a = campaign([(True, float(rng.normal(0, 1))) for _ in range(40)])
    b = campaign([(True, float(rng.normal(2, 1))) for _ in range(40)], first_seed=100)

    assert [found.key for found in differences(a, b) if found.differs] == ["x"]
