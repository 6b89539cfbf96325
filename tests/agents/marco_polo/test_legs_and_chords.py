"""Random legs and missed chords against Monte Carlo and NumPy's quadrature."""

from math import pi, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.marco_polo.legs import across_bisector, along_bisector, longest_stay_s
from agents.marco_polo.missed_chords import missed_share

SAMPLES = 200_000


@pytest.mark.parametrize(("legs", "leg"), [(1, 1.0), (4, 0.7), (10, 2.0)])
def test_mean_and_variance_of_legs(legs, leg):
    heading = np.random.default_rng(8).uniform(-pi / 2, pi / 2, (legs, SAMPLES))

    for found, sums in ((along_bisector(legs, leg), leg * np.cos(heading).sum(axis=0)),
                        (across_bisector(legs, leg), leg * np.sin(heading).sum(axis=0))):
        squares = (sums - found.mean_m) ** 2
        assert abs(sums.mean() - found.mean_m) <= 3.0 * sqrt(found.variance_m2 / SAMPLES)
        assert abs(squares.mean() - found.variance_m2) <= 3.0 * float(squares.std()) / sqrt(SAMPLES)


@pytest.mark.parametrize("depth", [2.0, 8.0, 13.0])
def test_few_targets_are_still_in_the_c_target_after_the_longest_stay(depth):
    confidence, targets, speed, leg_s = 0.99, 50_000, 0.3, 3.5
    stay_s = longest_stay_s(depth, speed, leg_s, confidence)
    legs = int(stay_s // leg_s)
    heading = np.random.default_rng(9).uniform(-pi / 2, pi / 2, (legs + 1, targets))

    advance = speed * (leg_s * np.cos(heading[:legs]).sum(axis=0) + (stay_s - legs * leg_s) * np.cos(heading[legs]))

    normal = 0.015                  # what the normal approximation misses with few legs: cosines are skewed
    still_in = float(np.mean(advance < depth))
    assert still_in <= 1.0 - confidence + normal + 3.0 * sqrt(0.01 * 0.99 / targets)
    assert stay_s >= depth / speed


@pytest.mark.parametrize(("arguments", "why"), [((-1.0, 1.0, 1.0), "depth_m"), ((1.0, 0.0, 1.0), "slowest_mps"),
                                                ((1.0, 1.0, 0.0), "leg_s"), ((1.0, 1.0, 1.0, 1.0), "confidence")])
def test_a_stay_of_nobody_is_refused(arguments, why):
    with pytest.raises(ValueError, match=why):
        longest_stay_s(*arguments)


@pytest.mark.parametrize(("radius", "speed", "exposure"), [(1.0, 0.7, 0.07), (1.0, 0.7, 1.0), (1.5, 1.0, 3.0),
                                                           (1.0, 2.0, 1.0), (0.5, 4.0, 1.0)])
def test_the_share_of_chords_missed(radius, speed, exposure):
    step = speed * exposure
    share = (np.arange(1_000_000) + 0.5) / 1_000_000

    found = missed_share(radius, speed, exposure)

    chords = 2.0 * radius * np.sqrt(1.0 - share ** 2)
    assert found == pytest.approx(float(np.mean(np.maximum(0.0, 1.0 - chords / step))), abs=1e-6)


@given(st.floats(0.1, 5.0), st.floats(0.01, 10.0), st.floats(0.001, 10.0))
def test_more_exposures_miss_fewer_chords(radius, speed, exposure):
    rare, frequent = missed_share(radius, speed, exposure), missed_share(radius, speed, exposure / 2)

    assert 0.0 <= frequent <= rare + 1e-12
    assert rare <= 1.0


def test_a_camera_without_exposures_is_refused():
    with pytest.raises(ValueError, match="exposure_s=0"):
        missed_share(1.0, 1.0, 0.0)
