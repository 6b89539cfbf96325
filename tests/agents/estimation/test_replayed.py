"""Late and out of order, against the same filter that was told everything in order."""

from math import nan
from random import Random

import numpy as np
import pytest

from agents.estimation import Inputs
from agents.estimation.particle_filter import ParticleFilter
from agents.estimation.replayed import Replayed
from agents.estimation.unscented_kalman import UnscentedKalman

STEP_NS = 70_000_000
KNOWN = (0.0, 0.0, 0.0), (0.01, 0.01, 0.49)
FILTERS = {
    "unscented Kalman filter": lambda: UnscentedKalman(*KNOWN, 0, Inputs(0.5, 0.1)),
    "particle filter": lambda: ParticleFilter(*KNOWN, np.random.default_rng(1), 0, Inputs(0.5, 0.1)),
}
KEEP = 5
SEEN = [(k * STEP_NS, 0.035 * k + 0.01 * (k % 3), 0.02 * (k % 5), Inputs(0.5, 0.1 * (k % 2)) if k % 4 else None)
        for k in range(1, 25)]


@pytest.fixture(params=FILTERS)
def make(request):
    return FILTERS[request.param]


@pytest.mark.parametrize("seed", range(5))
def test_the_order_of_arrival_does_not_matter(make, seed):
    """Each comes up to KEEP - 1 detections late; what was asked for in between does not matter either."""
    rng = Random(seed)
    arriving = [SEEN[k] for k in sorted(range(len(SEEN)), key=lambda k: k + rng.uniform(0, KEEP - 1))]
    assert arriving != SEEN
    in_order, mixed = make(), Replayed(make(), KEEP)

    assert all(in_order.correct(*seen) for seen in SEEN)
    assert all(mixed.correct(*seen) for seen in arriving)

    assert mixed.expect(SEEN[-1][0]) == in_order.expect(SEEN[-1][0])
    assert mixed.expect(SEEN[-1][0] + 9 * STEP_NS) == in_order.expect(SEEN[-1][0] + 9 * STEP_NS)


def test_an_older_detection_changes_the_estimate(make):
    with_it, without = Replayed(make()), Replayed(make())
    for seen in SEEN[:3] + SEEN[4:6]:
        assert with_it.correct(*seen)
        assert without.correct(*seen)

    counted = with_it.correct(SEEN[3][0], SEEN[3][1], SEEN[3][2] + 0.5)

    now_ns = SEEN[5][0]
    assert counted
    assert with_it.expect(now_ns)[1] > without.expect(now_ns)[1] + 0.01


def test_what_is_older_than_all_that_is_kept_is_left_out(make):
    mixed = Replayed(make(), KEEP)
    for seen in SEEN[:2] + SEEN[3:3 + KEEP]:
        mixed.correct(*seen)
    before = mixed.expect(SEEN[2 + KEEP][0])

    counted = mixed.correct(*SEEN[2])

    assert (counted, mixed.expect(SEEN[2 + KEEP][0])) == (False, before)


@pytest.mark.parametrize(("seen", "words"), [
    ((2 * STEP_NS, 0.0, 0.0), "with this time stamp already"), ((3 * STEP_NS, nan, 0.0), "expected finite numbers")])
def test_an_older_detection_that_cannot_be_is_refused_and_changes_nothing(make, seen, words):
    mixed = Replayed(make())
    for k in (1, 2, 4):
        mixed.correct(k * STEP_NS, 0.035 * k, 0.0)
    before = mixed.expect(4 * STEP_NS)

    with pytest.raises(ValueError, match=words):
        mixed.correct(*seen)

    assert mixed.expect(4 * STEP_NS) == before


def test_nothing_to_go_back_to_is_refused(make):
    with pytest.raises(ValueError, match="keep=0"):
        Replayed(make(), 0)
