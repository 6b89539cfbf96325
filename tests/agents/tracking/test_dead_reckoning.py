"""Dead reckoning against arcs worked out by hand, and against an integration of the unicycle in small steps."""

from __future__ import annotations

from math import cos, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.tracking.controller import Pose
from agents.tracking.dead_reckoning import DeadReckoning

RADIUS_M, TRACK_M = 0.1, 0.4
MS = 1_000_000


def reckoning(start: Pose = Pose(0.0, 0.0, 0.0)) -> DeadReckoning:
    return DeadReckoning(RADIUS_M, TRACK_M, start)


def test_a_quarter_circle_on_the_spot_wheel():
    """The left wheel stands, the right one drives a quarter of a circle with the track as its radius."""
    robot = reckoning()
    robot.read(0, 0.0, 0.0)
    robot.read(100 * MS, 0.0, (pi / 2) * TRACK_M / RADIUS_M)

    assert robot.pose_at(100 * MS) == pytest.approx((TRACK_M / 2, TRACK_M / 2, pi / 2), abs=1e-15)


def test_it_goes_on_along_the_last_arc_and_back_along_it():
    robot = reckoning(Pose(1.0, 2.0, pi / 2))
    robot.read(0, 5.0, 5.0)                                 # where the wheels start does not matter
    robot.read(10 * MS, 6.0, 6.0)

    assert robot.pose_at(10 * MS) == pytest.approx((1.0, 2.1, pi / 2))
    assert robot.pose_at(15 * MS) == pytest.approx((1.0, 2.15, pi / 2))
    assert robot.pose_at(5 * MS) == pytest.approx((1.0, 2.05, pi / 2))


def test_before_two_readings_it_stands_and_a_late_reading_changes_nothing():
    robot = reckoning()
    assert robot.pose_at(7 * MS) == (0.0, 0.0, 0.0)
    robot.read(10 * MS, 1.0, 1.0)
    robot.read(20 * MS, 2.0, 2.0)
    robot.read(20 * MS, 9.0, 0.0)
    robot.read(15 * MS, 9.0, 0.0)

    assert robot.pose_at(20 * MS) == pytest.approx((0.1, 0.0, 0.0))


@given(st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=1, max_size=6))
def test_many_arcs_are_the_unicycle_integrated_in_small_steps(arcs):
    """A midpoint step h of the unicycle is off by O(h^3): below |way| |turn|^2 / 24 each, summed over 2 000 steps."""
    robot, left, right = reckoning(), 0.0, 0.0
    robot.read(0, 0.0, 0.0)
    x = y = theta = bound = 0.0
    steps = 2_000
    for k, (dl, dr) in enumerate(arcs, start=1):
        left, right = left + dl, right + dr
        robot.read(k * MS, left, right)
        way, turn = RADIUS_M * (dl + dr) / 2 / steps, RADIUS_M * (dr - dl) / TRACK_M / steps
        for _ in range(steps):
            x, y, theta = x + way * cos(theta + turn / 2), y + way * sin(theta + turn / 2), theta + turn
        bound += steps * abs(way) * turn**2 / 24

    found = robot.pose_at(len(arcs) * MS)
    assert found.x_m == pytest.approx(x, abs=bound + 1e-12)
    assert found.y_m == pytest.approx(y, abs=bound + 1e-12)
    assert found.theta_rad == pytest.approx(theta, abs=1e-11)


@pytest.mark.parametrize("sizes", [(0.0, 1.0), (1.0, -1.0), (float("nan"), 1.0)])
def test_sizes_that_no_robot_has_are_refused(sizes):
    with pytest.raises(ValueError, match="expected more than 0"):
        DeadReckoning(*sizes)
