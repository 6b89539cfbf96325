"""Statistics of samples against exact fractions, and what has to hold whatever the samples are."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.judge.sample_statistics import STATISTIC
from tests.examples import examples

SAMPLES = st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=50)
ULP = 2.0 ** -53


@given(SAMPLES)
@settings(max_examples=examples(200), deadline=None)
def test_a_mean_lies_between_the_extremes_and_an_rms_below_the_largest_size(samples: list[float]) -> None:
    found = {name: statistic(np.array(samples)) for name, statistic in STATISTIC.items()}

    assert found["min"] <= found["mean"] <= found["max"]
    assert 0 <= found["rms"] <= found["abs_max"]


@given(SAMPLES)
@settings(max_examples=examples(200), deadline=None)
def test_mean_and_rms_are_those_of_exact_fractions(samples: list[float]) -> None:
    exact = [Fraction(sample) for sample in samples]
    size = max(abs(sample) for sample in exact)

    mean, rms = (Fraction(STATISTIC[name](np.array(samples))) for name in ("mean", "rms"))

    # n additions and three more operations, each wrong by at most one part in 2^53 of the largest partial result, and
    # below the smallest normal number by a fixed amount
    allowed = (len(samples) + 3) * Fraction(ULP) * size + Fraction(2) ** -1070
    assert abs(mean - sum(exact) / len(exact)) <= allowed
    assert abs(rms ** 2 - sum(sample ** 2 for sample in exact) / len(exact)) <= 3 * allowed * size + allowed ** 2


@pytest.mark.parametrize("samples", [[0.1] * 3, [0.3] * 7, [1e308] * 3, [-1e308, -1e308], [5e-324] * 3])
def test_equal_samples_have_their_value_as_mean(samples: list[float]) -> None:
    assert STATISTIC["mean"](np.array(samples)) == samples[0]


def test_a_sample_that_is_no_number_makes_mean_and_rms_no_number() -> None:
    for samples in ([1.0, math.nan], [math.inf, -math.inf]):
        assert math.isnan(STATISTIC["mean"](np.array(samples)))
    assert math.isnan(STATISTIC["rms"](np.array([1.0, math.nan])))
