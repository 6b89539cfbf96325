"""What every estimator does alike, whatever it is made of."""

from math import hypot, inf, nan

import numpy as np
import pytest

from agents.estimation import Inputs
from agents.estimation.circle_filter import CircleFilter
from agents.estimation.particle_filter import ParticleFilter
from agents.estimation.replayed import Replayed
from agents.estimation.unscented_kalman import UnscentedKalman

STEP_NS = 70_000_000
SPEED, SIGMA_M = 0.5, 0.1
DRIVEN = Inputs(SPEED, 0.0)
KNOWN = (0.0, 0.0, 0.0), (0.01, 0.01, 0.01)

ESTIMATORS = {
    "circle filter": lambda: CircleFilter(5, rho_m=0.0, sigma_m=SIGMA_M),
    "unscented Kalman filter": lambda: UnscentedKalman(*KNOWN, 0, DRIVEN),
    "particle filter": lambda: ParticleFilter(*KNOWN, np.random.default_rng(1), 0, DRIVEN),
    "unscented Kalman filter, replayed": lambda: Replayed(UnscentedKalman(*KNOWN, 0, DRIVEN)),
    "particle filter, replayed": lambda: Replayed(ParticleFilter(*KNOWN, np.random.default_rng(1), 0, DRIVEN)),
}


@pytest.fixture(params=ESTIMATORS)
def estimator(request):
    return ESTIMATORS[request.param]()


def follow(estimator, detections, gap=3):
    """A target that drives along x at constant speed, seen exactly every `gap` steps."""
    for k in range(1, detections + 1):
        t_ns = k * gap * STEP_NS
        assert estimator.correct(t_ns, SPEED * t_ns * 1e-9, 0.0, DRIVEN)
    return detections * gap * STEP_NS


def test_a_straight_target_is_expected_where_it_will_be(estimator):
    """The worst of them has the noise of the particles' steps: sqrt(4 (0.1)^2) within 1000 of them, and what is left of
    their corrections' error, some 0.1 of SIGMA."""
    t_ns = follow(estimator, 8)

    x, y = estimator.expect(t_ns + 4 * STEP_NS)

    assert hypot(x - SPEED * (t_ns + 4 * STEP_NS) * 1e-9, y) < 0.1 * SIGMA_M + 5 * 0.2 / 1000 ** 0.5


def test_a_correction_brings_the_estimate_towards_the_detection(estimator):
    t_ns = follow(estimator, 8) + 3 * STEP_NS
    x, y = estimator.expect(t_ns)

    estimator.correct(t_ns, x, y + 0.3, DRIVEN)

    assert abs(estimator.expect(t_ns)[1] - (y + 0.3)) < 0.25


def test_asking_changes_nothing_but_the_time_that_was_reached(estimator):
    """For the particles another draw of their noise."""
    t_ns = follow(estimator, 8)
    for k in range(1, 5):
        estimator.expect(t_ns + k * STEP_NS)

    first, second = (estimator.expect(t_ns + 4 * STEP_NS) for _ in range(2))

    assert first == second


def test_a_detection_that_comes_after_later_questions_counts_by_its_time_stamp(estimator):
    """An answer under way: the place was asked for meanwhile, the detection is still the newest."""
    t_ns = follow(estimator, 8)
    estimator.expect(t_ns + 9 * STEP_NS)

    counted = estimator.correct(t_ns + 3 * STEP_NS, SPEED * (t_ns + 3 * STEP_NS) * 1e-9, 0.0, DRIVEN)

    x, y = estimator.expect(t_ns + 4 * STEP_NS)
    assert counted
    assert hypot(x - SPEED * (t_ns + 4 * STEP_NS) * 1e-9, y) < 0.1 * SIGMA_M + 5 * 0.2 / 1000 ** 0.5


def test_an_older_detection_does_not_take_the_place_of_newer_ones(estimator):
    """It joins the window, is replayed or left out: the target is where it was last seen."""
    t_ns = follow(estimator, 8)

    estimator.correct(t_ns - STEP_NS, SPEED * (t_ns - STEP_NS) * 1e-9, 0.0, DRIVEN)

    x, y = estimator.expect(t_ns)
    assert hypot(x - SPEED * t_ns * 1e-9, y) < 0.1 * SIGMA_M + 5 * 0.1 / 1000 ** 0.5


def test_a_detection_from_before_everything_is_left_out(estimator):
    t_ns = follow(estimator, 8)
    before = estimator.expect(t_ns)

    counted = estimator.correct(STEP_NS, 9.0, 9.0, DRIVEN)

    assert (counted, estimator.expect(t_ns)) == (False, before)


def test_unknown_inputs_are_the_last_known_ones(estimator):
    t_ns = follow(estimator, 8)

    estimator.correct(t_ns + STEP_NS, SPEED * (t_ns + STEP_NS) * 1e-9, 0.0)

    x, y = estimator.expect(t_ns + 5 * STEP_NS)
    assert hypot(x - SPEED * (t_ns + 5 * STEP_NS) * 1e-9, y) < 0.1 * SIGMA_M + 5 * 0.2 / 1000 ** 0.5


@pytest.mark.parametrize(("x_m", "y_m"), [(nan, 0.0), (0.0, nan), (inf, 0.0), (0.0, -inf), (1e200, 0.0)])
def test_what_is_no_place_is_refused_and_changes_nothing(estimator, x_m, y_m):
    t_ns = follow(estimator, 8)
    before = estimator.expect(t_ns)

    with pytest.raises(ValueError, match="expected finite numbers"):
        estimator.correct(t_ns + STEP_NS, x_m, y_m, DRIVEN)

    assert estimator.expect(t_ns) == before


def test_a_time_stamp_that_comes_twice_is_refused(estimator):
    t_ns = follow(estimator, 8)

    with pytest.raises(ValueError, match="with this time stamp already"):
        estimator.correct(t_ns, 0.0, 0.0, DRIVEN)


def test_questions_go_forward_in_time(estimator):
    t_ns = follow(estimator, 8)

    with pytest.raises(ValueError, match="ask in order"):
        estimator.expect(t_ns - 1)
