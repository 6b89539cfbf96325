from __future__ import annotations

from math import pi, sin, sqrt

import numpy as np
import pytest
from scipy import stats

from netem.core.random_streams import stream
from netem.impairments.duplicate import Duplicate

FRAMES = 20_000


@pytest.mark.parametrize("ratio", [0.01, 0.3])
def test_the_share_of_duplicated_copies_is_binomial(ratio, frames):
    twice = Duplicate(ratio, rng=stream(7, "duplicate"))

    copies = sum(len(list(twice.carry(transit))) for transit in frames(FRAMES))

    assert abs(copies - FRAMES - ratio * FRAMES) < 4 * sqrt(ratio * (1 - ratio) * FRAMES)


def test_the_original_comes_first_and_its_twin_later_with_the_same_number(frames):
    always = Duplicate(1.0, extra_delay_ns=500, rng=stream(7, "duplicate"))
    transit = frames(3)[2]

    original, twin = always.carry(transit)

    assert original is transit
    assert (twin.number, twin.data, twin.arrival_ns) == (2, transit.data, transit.arrival_ns + 500)


def test_correlated_duplicates_cluster_as_the_copula_says_and_keep_their_ratio(frames):
    runs, length, ratio, correlation = 30, 1000, 0.2, 0.7
    rho = 2 * sin(pi * correlation / 6)
    cut = stats.norm.ppf(ratio)
    both = stats.multivariate_normal([0, 0], [[1, rho], [rho, 1]]).cdf([cut, cut])

    shares, pairs = [], []
    for run in range(runs):
        twice = Duplicate(ratio, correlation=correlation, rng=stream(run, "duplicate"))
        doubled = np.array([len(list(twice.carry(transit))) == 2 for transit in frames(length)])
        shares.append(doubled.mean())
        pairs.append((doubled[1:] & doubled[:-1]).mean())

    assert abs(np.mean(shares) - ratio) < 4 * np.std(shares, ddof=1) / sqrt(runs)
    assert abs(np.mean(pairs) - both) < 4 * np.std(pairs, ddof=1) / sqrt(runs)
    assert both > 2 * ratio ** 2


@pytest.mark.parametrize(("settings", "message"), [
    ({"duplicate_ratio": 1.2}, "duplicate_ratio=1.2: expected 0 <= duplicate_ratio <= 1"),
    ({"duplicate_ratio": 0.1, "extra_delay_ns": -1}, "extra_delay_ns=-1: expected extra_delay_ns >= 0"),
    ({"duplicate_ratio": 0.1, "correlation": -1}, "correlation=-1: expected -1 < correlation < 1"),
])
def test_nonsense_is_refused_with_value_and_rule(settings, message):
    with pytest.raises(ValueError, match=message):
        Duplicate(**settings, rng=stream(7, "duplicate"))
