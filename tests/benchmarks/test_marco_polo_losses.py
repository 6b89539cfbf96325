"""The statistics of captures over the loss ratio."""

import numpy as np
import pytest

from benchmarks.marco_polo_losses import CAPTURED, captures, holm, spread, window_ns


def test_p_values_are_adjusted_as_by_hand():
    adjusted = holm({(0, 0.0): 0.01, (0, 0.2): 0.04, (1, 0.0): 0.03, (1, 0.2): 0.9})

    assert adjusted == pytest.approx({(0, 0.0): 0.04, (1, 0.0): 0.09, (0, 0.2): 0.09, (1, 0.2): 0.9})


def test_the_spread_of_independent_targets_is_one():
    games = 20_000
    caught = np.random.default_rng(1).binomial(3, 0.25, games).astype(float)

    # variance of a sample variance: about 2 / games for a kurtosis near that of a normal distribution
    assert spread({CAPTURED: caught}) == pytest.approx(1.0, abs=5 * np.sqrt(2 / games))
    assert spread({CAPTURED: np.repeat([0.0, 3.0], [30, 10])}) > 2.9


def test_captures_are_a_share_of_all_targets():
    found = captures({CAPTURED: np.array([0.0, 1.0, 2.0, 0.0])})

    assert found.value == 3 / 12
    assert found.low is not None
    assert found.low < 3 / 12


@pytest.mark.parametrize(("losses", "least_ms"), [(0, 80), (1, 150), (2, 220), (3, 290)])
def test_windows_are_the_least(losses: int, least_ms: int):
    assert window_ns(losses) == least_ms * 1_000_000
