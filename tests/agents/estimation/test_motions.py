"""Speeds along a curve against NumPy's polynomials and against integration step by step."""

import numpy as np
import pytest

from agents.estimation.motions import MOTIONS, Motion

TIMES_S = [-2.0, -1.7, -0.9, -0.4, 0.0]
LENGTHS_M = [0.1, 0.22, 0.45, 0.7, 0.78]


@pytest.mark.parametrize(("v", "a"), [(0.5, 0.0), (0.3, 0.2), (0.3, -0.2), (-0.7, 0.4), (0.7, 0.1), (-0.7, -1.0)])
def test_the_way_is_the_integral_of_the_clipped_speed(v, a):
    """Midpoint rule: exact but in the step with the corner, where it is off by at most a dt^2."""
    motion, dt_s, n = Motion(0.0, v, a, 0.7), 6.0, 6000

    middles = (np.arange(n) + 0.5) * dt_s / n
    expected = np.clip(v + a * middles, -0.7, 0.7).sum() * dt_s / n

    assert motion.way_m(dt_s) == pytest.approx(expected, abs=abs(a) * (dt_s / n) ** 2 + 1e-12)


def test_the_line_of_speeds_is_the_least_squares_one_and_clipped():
    speeds = np.diff(LENGTHS_M) / np.diff(TIMES_S)
    slope, value = np.polyfit((np.array(TIMES_S)[1:] + np.array(TIMES_S)[:-1]) / 2, speeds, 1)

    found, clipped = (MOTIONS["line"](TIMES_S, LENGTHS_M, v_max) for v_max in (9.0, 0.1))

    assert (found.s_m, found.v_mps, found.a_mps2) == pytest.approx((0.78, value, slope), abs=1e-12)
    assert (clipped.v_mps, clipped.a_mps2) == pytest.approx((0.1, slope), abs=1e-12)


def test_smoothed_is_the_least_squares_line_through_the_places():
    slope, value = np.polyfit(TIMES_S, LENGTHS_M, 1)

    found = MOTIONS["smoothed"](TIMES_S, LENGTHS_M, 9.0)

    assert (found.s_m, found.v_mps, found.a_mps2) == pytest.approx((value, slope, 0.0), abs=1e-12)


def test_mean_and_last_sign_differ_after_a_reversal_only():
    back = [0.0, 0.5, 1.0, 1.2, 0.9]

    same = [MOTIONS[name](TIMES_S, LENGTHS_M, 9.0).v_mps for name in ("mean", "last_sign")]
    turned = [MOTIONS[name](TIMES_S, back, 9.0).v_mps for name in ("mean", "last_sign")]

    assert same == pytest.approx([0.34, 0.34])
    assert turned == pytest.approx([0.45, -0.45])


@pytest.mark.parametrize("name", MOTIONS)
def test_no_rule_gives_more_speed_than_the_target_has(name):
    rng = np.random.default_rng(2)
    for _ in range(100):
        times = np.cumsum(rng.uniform(0.07, 1.0, 4)).tolist()

        motion = MOTIONS[name](times, rng.normal(0, 1, 4).tolist(), 0.7)

        for dt_s in (0.01, 1.0, 10.0):
            assert abs(motion.way_m(dt_s)) <= 0.7 * dt_s * (1 + 1e-12)
