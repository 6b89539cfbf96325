"""Frames and rotations against SciPy's."""

from __future__ import annotations

from math import pi
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from firmware_sim.autopilot.frames import (
    down_axis,
    frd_of,
    ned_of,
    ned_quaternion,
    roll_pitch_yaw,
    tilted,
    to_world,
    wrapped,
    yaw_of,
)
from tests.firmware_sim.autopilot.attitude import from_roll_pitch_yaw

RNG = Random("7/frames")
QUATERNIONS = [tuple(Rotation.random(random_state=k).as_quat(scalar_first=True)) for k in range(8)]


@pytest.mark.parametrize("q", QUATERNIONS)
def test_the_attitude_in_ned_turns_frd_vectors_as_the_plants_turns_its_own(q: tuple[float, ...]) -> None:
    v = (RNG.gauss(0, 1), RNG.gauss(0, 1), RNG.gauss(0, 1))
    in_enu = Rotation.from_quat(q, scalar_first=True).apply(v)

    in_ned = to_world(ned_quaternion(*q), frd_of(*v))

    np.testing.assert_allclose(in_ned, ned_of(*in_enu), atol=1e-15)
    np.testing.assert_allclose(ned_quaternion(*ned_quaternion(*q)), q, atol=1e-15)


def test_a_vehicle_along_the_plants_x_axis_faces_east() -> None:
    assert yaw_of(ned_quaternion(1.0, 0.0, 0.0, 0.0)) == pytest.approx(pi / 2)


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_angles_are_those_of_yaw_then_pitch_then_roll(roll: float, pitch: float, yaw: float) -> None:
    w, x, y, z = from_roll_pitch_yaw(roll, pitch, yaw)

    # asin loses half the digits near 90 degrees: sqrt(2^-52) is 1.5e-8
    assert roll_pitch_yaw((w, x, y, z)) == pytest.approx((roll, pitch, yaw), abs=1e-6)
    assert roll_pitch_yaw((-w, -x, -y, -z)) == pytest.approx((roll, pitch, yaw), abs=1e-6)


@pytest.mark.parametrize("yaw", [-3.0, 0.0, 1.0])
def test_a_tilt_puts_the_z_axis_where_it_is_told_and_keeps_the_heading_of_a_level_vehicle(yaw: float) -> None:
    down = np.array([0.3, -0.4, 0.9]) / np.linalg.norm([0.3, -0.4, 0.9])

    np.testing.assert_allclose(down_axis(tilted(tuple(down), yaw)), down, atol=1e-15)
    assert yaw_of(tilted((0.0, 0.0, 1.0), yaw)) == pytest.approx(yaw)


@pytest.mark.parametrize(("angle", "expected"), [(3 * pi / 2, -pi / 2), (-4.0, 2 * pi - 4.0), (0.5, 0.5),
                                                 (20.0, 20 - 6 * pi)])
def test_angles_wrap_to_half_a_turn(angle: float, expected: float) -> None:
    assert wrapped(angle) == pytest.approx(expected)
