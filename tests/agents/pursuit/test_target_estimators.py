"""The estimators that a pursuing robot may have, told nothing but detections."""

from math import cos, hypot, sin
from random import Random

import numpy as np
import pytest

from agents.estimation import Inputs
from agents.estimation.circle_filter import CircleFilter
from agents.estimation.particle_filter import ParticleFilter
from agents.estimation.predicted_path import PredictedPath
from agents.estimation.unknown_inputs import UnknownInputs
from agents.pursuit.target_estimators import ESTIMATORS, Known, target_estimator

STEP_NS, GAP_NS = 70_000_000, 1_400_000_000
KNOWN = Known(7, 0.2, 0.7, 0.1, STEP_NS, 0.01, 1000)
RADIUS_M, SPEED_MPS = 3.0, 0.6


def place(t_ns):
    angle = SPEED_MPS / RADIUS_M * t_ns * 1e-9
    return RADIUS_M * sin(angle), RADIUS_M * (1 - cos(angle))


def detections(n=40, sigma_m=0.1, seed=1):
    """Every 1.4 s on a circle of one turn in 31 s that begins at the origin along x."""
    rng = Random(seed)
    for k in range(n):
        x, y = place(GAP_NS * k)
        yield GAP_NS * k, x + rng.gauss(0, sigma_m), y + rng.gauss(0, sigma_m)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_it_follows_a_target_on_a_circle_with_less_error_than_the_newest_detection_would_have(name):
    estimator, errors, held = target_estimator(name, KNOWN, Random(2)), [], []
    for k, (t_ns, x, y) in enumerate(detections()):
        assert estimator.correct(t_ns, x, y)
        if k >= 10:
            later_ns = t_ns + GAP_NS - STEP_NS
            true = place(later_ns)
            errors.append(hypot(*np.subtract(estimator.expect(later_ns), true)))
            held.append(hypot(*np.subtract((x, y), true)))

    assert np.mean(errors) < 0.5 * np.mean(held)        # 0.8 m of way


@pytest.mark.parametrize("name", ESTIMATORS)
def test_the_same_seed_gives_the_same_places_however_often_one_asks_and_in_whatever_order_they_arrive(name):
    seen = list(detections())
    often, rarely = target_estimator(name, KNOWN, Random(2)), target_estimator(name, KNOWN, Random(2))
    swapped = [*seen[:20], seen[21], seen[20], *seen[22:]]

    for one in seen:
        often.correct(*one)
        for k in range(50):
            often.expect(one[0] + k * 7_000_000)
    for one in swapped:
        assert rarely.correct(*one)

    end_ns = seen[-1][0]
    assert [often.expect(end_ns + k * STEP_NS // 3) for k in range(30)] == [
        rarely.expect(end_ns + k * STEP_NS // 3) for k in range(30)]


def test_particles_are_drawn_from_the_random_stream_that_is_given():
    places = []
    for seed in (2, 2, 3):
        estimator = target_estimator("particle", KNOWN, Random(seed))
        for one in detections():
            estimator.correct(*one)
        places.append(estimator.expect(40 * GAP_NS))

    assert places[0] == places[1] != places[2]


def test_a_path_has_the_places_of_a_filter_that_is_asked_in_steps_and_lines_in_between():
    def particles():
        return ParticleFilter((0.0, 0.0, 0.0), (0.01, 0.01, 0.1), np.random.default_rng(1), 0, Inputs(0.5, 0.3))

    path, plain = PredictedPath(particles(), 0, STEP_NS), particles()
    in_steps = [plain.expect(k * STEP_NS) for k in range(5)]

    middle = path.expect(2 * STEP_NS + STEP_NS // 2)

    assert [path.expect(k * STEP_NS) for k in (4, 0, 2, 3, 1)] == [in_steps[k] for k in (4, 0, 2, 3, 1)]
    assert middle == pytest.approx(np.mean(in_steps[2:4], axis=0), abs=1e-15)


def test_a_question_before_the_newest_detection_is_refused():
    path = PredictedPath(ParticleFilter((0.0, 0.0, 0.0), (0.01, 0.01, 0.1), np.random.default_rng(1)), 0, STEP_NS)
    path.correct(STEP_NS, 0.0, 0.0)

    with pytest.raises(ValueError, match="the filter is at 70000000 ns already"):
        path.expect(STEP_NS - 1)


class Told:
    """Records what an estimator is given."""

    def __init__(self, t_ns, state, inputs):
        self.start, self.inputs = (t_ns, state), [inputs]

    def expect(self, t_ns):
        return 0.0, 0.0

    def correct(self, t_ns, x_m, y_m, inputs=None):
        self.inputs.append(inputs)
        return True


def told(seen):
    started = []

    def start(*known):
        started.append(Told(*known))
        return started[-1]

    estimator = UnknownInputs(CircleFilter(7, rho_m=0.0, v_max_mps=0.7, sigma_m=0.0), start)
    for one in seen:
        estimator.correct(*one)
    only, = started
    return only


def test_the_filter_starts_on_the_first_curve_and_gets_the_speed_along_it_and_the_turn_rate():
    exact = list(detections(sigma_m=0.0))

    found = told(exact)

    t_ns, (x, y, theta) = found.start
    assert t_ns == exact[2][0]
    assert (x, y) == pytest.approx(exact[2][1:], abs=1e-9)
    assert theta == pytest.approx(SPEED_MPS / RADIUS_M * t_ns * 1e-9, abs=1e-6)
    for v, omega in found.inputs:
        assert (v, omega) == pytest.approx((SPEED_MPS, SPEED_MPS / RADIUS_M), rel=1e-6)


def test_a_target_that_reverses_keeps_its_heading_and_gets_a_negative_speed():
    there = [(k * GAP_NS, 0.2 * k, 0.0) for k in range(8)]
    back = [((8 + k) * GAP_NS, 1.4 - 0.2 * (k + 1), 0.0) for k in range(8)]

    found = told([*there, *back])

    assert found.start[1][2] == pytest.approx(0.0, abs=1e-9)
    assert found.inputs[5].v_mps == pytest.approx(0.2 / 1.4, rel=1e-9)
    assert found.inputs[-1].v_mps == pytest.approx(-0.2 / 1.4, rel=1e-9)
    forwards = [inputs.v_mps > 0 for inputs in found.inputs]
    assert forwards == sorted(forwards, reverse=True)


@pytest.mark.parametrize(("name", "change", "says"), [
    ("kalman", {}, "estimator='kalman': expected one of circle, ukf, particle"),
    ("ukf", {"sigma_m": 0.0}, "sigma_m=0.0: a Bayesian filter needs a noise of more than 0"),
    ("particle", {"process_m2": -0.1}, "process_m2=-0.1: expected 0 or more"),
    ("particle", {"particles": 1}, "particles=1: expected at least 2"),
    ("circle", {"window": 2}, "window=2: a circle needs Gamma of 3"),
    ("ukf", {"window": 2}, "window=2: a circle needs Gamma of 3"),
])
def test_what_an_estimator_cannot_work_with_is_refused(name, change, says):
    with pytest.raises(ValueError) as refused:
        target_estimator(name, KNOWN._replace(**change), Random(1))

    assert says in str(refused.value)
