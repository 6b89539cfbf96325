"""Exact circles and lines have closed forms; noise is judged by its statistics."""

from itertools import permutations
from math import cos, hypot, pi, sin

import numpy as np
import pytest

from agents.estimation.circle_filter import CircleFilter
from agents.estimation.motions import MOTIONS

SECOND = 1_000_000_000


def on_circle(radius_m, speed_mps, t_s, left=True):
    turn = speed_mps * t_s / radius_m
    return 3 + radius_m * sin(turn), -2 + (radius_m if left else -radius_m) * (1 - cos(turn))


def seen(detections, window=17, **settings):
    """A filter that has seen [(t_s, (x, y)), ...]."""
    found = CircleFilter(window, **{"rho_m": 0.0, "v_max_mps": 2.0, "sigma_m": 0.0, **settings})
    for t_s, (x, y) in detections:
        assert found.correct(round(t_s * SECOND), x, y)
    return found


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("left", [True, False])
@pytest.mark.parametrize("speed_mps", [0.5, -0.5])
def test_a_target_on_a_circle_is_expected_on_it(left, speed_mps, motion):
    times = [0.0, 0.3, 0.4, 0.9, 1.5]

    found = seen([(t, on_circle(1.2, speed_mps, t, left)) for t in times], motion=motion)

    for ahead_s in (0.0, 0.2, 3.0, 20.0):
        there = found.expect(round((1.5 + ahead_s) * SECOND))
        assert there == pytest.approx(on_circle(1.2, speed_mps, 1.5 + ahead_s, left), abs=1e-7)
    assert found.motion.v_mps == pytest.approx(0.5, abs=1e-9)
    forward = on_circle(1.2, speed_mps, 1.5 + 1e-6, left)
    assert found.curve.tx * (forward[0] - found.curve.x_m) + found.curve.ty * (forward[1] - found.curve.y_m) > 0


def test_the_direction_of_travel_is_not_that_of_the_chord():
    """After 300 degrees the chord from first to last detection points backwards."""
    times = [k * 0.5 for k in range(17)]
    speed = 300 / 360 * 2 * pi / times[-1]

    found = seen([(t, on_circle(1.0, speed, t)) for t in times])

    assert found.expect(round(9.0 * SECOND)) == pytest.approx(on_circle(1.0, speed, 9.0), abs=1e-7)


@pytest.mark.parametrize("turns_a_gap", [0.1, 0.3, 0.49])
def test_arc_lengths_are_unwrapped_up_to_half_a_turn_a_gap(turns_a_gap):
    speed = turns_a_gap * 2 * pi * 0.4

    found = seen([(k, on_circle(0.4, speed, k)) for k in range(9)], v_max_mps=5.0)

    assert found.motion.v_mps == pytest.approx(speed, abs=1e-9)


def test_beyond_half_a_turn_a_gap_it_seems_to_go_backwards():
    """Documented limit: 0.6 of a turn forward looks like 0.4 backward."""
    found = seen([(k, on_circle(0.4, 0.6 * 2 * pi * 0.4, k)) for k in range(9)], v_max_mps=5.0)

    assert found.motion.v_mps == pytest.approx(0.4 * 2 * pi * 0.4, abs=1e-9)


def test_a_target_on_a_line_is_expected_on_it():
    found = seen([(k * 0.2, (1 + 0.03 * k, 2 - 0.04 * k)) for k in range(5)])

    assert found.expect(2 * SECOND) == pytest.approx((1 + 0.03 * 10, 2 - 0.04 * 10), abs=1e-9)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_target_that_gains_speed_is_followed_by_the_line_of_its_speeds(direction):
    """Way 0.1 t + 0.05 t^2: the mean speed of an interval is the speed at its middle, so the line is exact."""
    def place(t_s):
        return direction * (0.1 * t_s + 0.05 * t_s ** 2), 0.0

    found = seen([(t, place(t)) for t in (0.0, 0.3, 1.0, 1.4, 2.0)], motion="line")

    assert found.expect(3 * SECOND) == pytest.approx(place(3.0), abs=1e-9)


def test_a_target_that_stands_still_is_expected_there():
    found = seen([(k * 0.2, (1.0, 2.0)) for k in range(5)])

    assert found.expect(100 * SECOND) == (1.0, 2.0)


def test_a_target_that_is_faster_than_it_can_be_is_expected_at_its_limit():
    found = seen([(k, (3.0 * k, 0.0)) for k in range(4)], v_max_mps=0.7)

    assert found.expect(5 * SECOND) == pytest.approx((9.0 + 2 * 0.7, 0.0), abs=1e-9)


def test_fewer_than_three_detections_say_where_it_was_last():
    found = seen([(0.0, (1.0, 1.0)), (1.0, (2.0, 1.0))])

    assert found.expect(5 * SECOND) == (2.0, 1.0)
    with pytest.raises(ValueError, match="there is no detection yet"):
        CircleFilter().expect(0)


def test_the_window_holds_the_last_gamma_detections():
    """Far away first; the fit forgets it when Gamma others have come."""
    line = [(k, (0.1 * k, 0.0)) for k in range(1, 6)]

    found = seen([(0, (0.0, 50.0)), *line], window=5)

    assert found.expect(8 * SECOND) == pytest.approx((0.8, 0.0), abs=1e-9)


def test_within_rho_the_fit_stays_and_beyond_it_is_made_anew():
    found = seen([(k, (0.5 * k, 0.0)) for k in range(4)], rho_m=0.2)
    assert (found.kept, found.refitted) == (1, 1)

    found.correct(4 * SECOND, 2.0, 0.19)
    kept = found.expect(5 * SECOND)
    found.correct(5 * SECOND, 2.5, 0.21)

    assert kept == pytest.approx((2.5, 0.0), abs=1e-12)
    assert (found.kept, found.refitted) == (2, 2)
    assert found.expect(5 * SECOND)[1] > 0.05


def test_noise_on_a_straight_path_makes_a_circle_without_the_gate_only():
    """The circle's gain is sigma^2 times a chi-square variable of one degree of freedom: above 9 in 0.27 % of fits."""
    rng, fits = np.random.default_rng(3), 400
    straight = {True: 0, False: 0}
    for _ in range(fits):
        points = [(1.0 * k, (0.7 * k + rng.normal(0, 0.1), rng.normal(0, 0.1))) for k in range(3)]
        for gate in straight:
            straight[gate] += seen(points, sigma_m=0.1, line_gate=gate).curve.k_per_m == 0.0

    assert straight[True] >= fits * (1 - 0.0027) - 5 * (0.0027 * fits) ** 0.5 - 1
    assert straight[False] == 0


def test_a_bend_that_is_more_than_noise_stays_a_circle():
    """Sagitta 0.5 m against sigma = 0.1 m: the line's residuals are 17 (0.5 sqrt(4/45))^2 m^2, 4 times 9 sigma^2."""
    found = seen([(0.2 * k, on_circle(1.0, 2.09 / 3.2, 0.2 * k)) for k in range(17)], sigma_m=0.1)

    assert abs(found.curve.k_per_m) == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize("order", list(permutations(range(5)))[::7])
def test_detections_in_any_order_give_the_fit_of_their_time_stamps(order):
    rng = np.random.default_rng(4)
    detections = [(0.3 * k, (0.1 * k + rng.normal(0, 0.05), rng.normal(0, 0.05))) for k in range(5)]

    found = seen([detections[k] for k in order], window=5)

    assert found.expect(3 * SECOND) == pytest.approx(seen(detections, window=5).expect(3 * SECOND), abs=1e-12)


def test_a_late_detection_pushes_the_oldest_out_of_a_full_window():
    points = {k: on_circle(1.0, 0.3, k) for k in range(8)}
    found = seen([(k, points[k]) for k in (0, 1, 2, 4, 5)], window=5)

    counted = found.correct(3 * SECOND, *points[3])
    refused = found.correct(0, *points[0])

    assert (counted, refused) == (True, False)
    assert found.expect(7 * SECOND) == pytest.approx(points[7], abs=1e-7)


def test_a_late_detection_may_not_have_the_time_stamp_of_another():
    found = seen([(k, on_circle(1.0, 0.3, k)) for k in range(5)])

    with pytest.raises(ValueError, match="with this time stamp already"):
        found.correct(2 * SECOND, 0.0, 0.0)


@pytest.mark.parametrize(("wrong", "words"), [
    ({"window": 2}, "window=2: a circle needs Gamma of 3"), ({"rho_m": -0.1}, "rho_m=-0.1"),
    ({"rho_m": float("nan")}, "rho_m=nan"), ({"v_max_mps": 0.0}, "the speed more than 0"),
    ({"sigma_m": -1.0}, "sigma_m=-1.0"), ({"motion": "means"}, "expected one of mean")])
def test_nonsense_is_refused(wrong, words):
    with pytest.raises(ValueError, match=words):
        CircleFilter(**wrong)


def test_smoothing_the_place_gains_what_averaging_17_detections_gains():
    """Straight, sigma 0.1: at the end of 17 equal steps the variance of a line's value is 0.22 sigma^2 (4 / n).

    The mean of 300 squares of two such normal variables has a standard error of 6 %; some lines bend."""
    rng, errors = np.random.default_rng(5), {"mean": [], "smoothed": []}
    for _ in range(300):
        noise = rng.normal(0, 0.1, (17, 2))
        for motion, found in errors.items():
            filter_ = seen([(0.2 * k, (0.3 * k + noise[k, 0], noise[k, 1])) for k in range(17)], motion=motion,
                           sigma_m=0.1)
            x, y = filter_.expect(16 * SECOND // 5)
            found.append(hypot(x - 4.8, y))

    n = 17
    at_the_end = 2 * (2 * n - 1) / (n * (n + 1)) * 0.01
    assert np.mean(np.square(errors["smoothed"])) < 2 * at_the_end * 1.3
    assert np.mean(np.square(errors["mean"])) > 0.01
