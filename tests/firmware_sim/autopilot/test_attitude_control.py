"""Attitude and position control on single states, against the torque and force that they ought to give."""

from __future__ import annotations

from math import acos, atan, pi, tan

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from firmware_sim.autopilot.airframe import GRAVITY, Airframe
from firmware_sim.autopilot.attitude_control import YAW_MOST, AttitudeControl
from firmware_sim.autopilot.frames import down_axis, to_world, yaw_of
from firmware_sim.autopilot.position_control import INTEGRAL_MOST, LEAST_LIFT, PositionControl
from firmware_sim.autopilot.vehicle import Quaternion
from tests.firmware_sim.autopilot.attitude import from_roll_pitch_yaw

J = np.array(Airframe().inertia_kgm2)
LEVEL: Quaternion = (1.0, 0.0, 0.0, 0.0)
STILL = (0.0, 0.0, 0.0)


@pytest.fixture
def attitude() -> AttitudeControl:
    control = AttitudeControl(Airframe())
    control.k_angle, control.k_rate, control.k_yaw, control.k_yaw_rate = 100.0, 20.0, 6.0, 5.0
    return control


@pytest.mark.parametrize("q", [LEVEL, from_roll_pitch_yaw(0.4, -0.3, 2.0), from_roll_pitch_yaw(-2.0, 1.0, -3.0)])
@pytest.mark.parametrize("turn", [(0.01, 0.0, 0.0), (0.0, -0.02, 0.0), (0.0, 0.0, 0.03), (0.01, 0.02, -0.01)])
def test_the_torque_turns_about_the_axis_of_the_missing_rotation(q: Quaternion, turn: tuple[float, ...],
                                                                 attitude: AttitudeControl) -> None:
    target = (Rotation.from_quat(q, scalar_first=True) * Rotation.from_rotvec(turn)).as_quat(scalar_first=True)

    torque = attitude.torque(q, STILL, tuple(target), STILL)

    # 2 sin(a / 2) for a: third order
    np.testing.assert_allclose(torque, J * np.array([100.0, 100.0, 6.0]) * turn, rtol=0.03**2, atol=1e-15)
    np.testing.assert_allclose(attitude.torque(q, STILL, tuple(-target), STILL), torque, atol=1e-15)


def test_rates_are_damped_towards_their_targets(attitude: AttitudeControl) -> None:
    rates, wanted = (0.1, -0.2, 0.3), (0.5, 0.0, 0.1)
    expected = J * np.array([20.0 * 0.4, 20.0 * 0.2, 5.0 * -0.2])

    np.testing.assert_allclose(attitude.torque(LEVEL, rates, LEVEL, wanted), expected, atol=1e-15)
    np.testing.assert_allclose(attitude.rate_torque(rates, wanted), expected, atol=1e-15)


@pytest.mark.parametrize("turn", [0.6, 2.0, 3.1, -2.0])
def test_a_large_error_of_the_heading_counts_as_a_small_one_and_leaves_roll_and_pitch_alone(
        turn: float, attitude: AttitudeControl) -> None:
    x, y, z = attitude.torque(LEVEL, STILL, from_roll_pitch_yaw(0.0, 0.0, turn), STILL)

    assert (x, y) == (0.0, 0.0)
    assert z == pytest.approx(J[2] * 6.0 * YAW_MOST * np.sign(turn))


# --- position


@pytest.fixture
def position() -> PositionControl:
    control = PositionControl(0.5)
    control.kp, control.kd, control.ki = 4.0, 3.0, 1.0
    control.kp_z, control.kd_z, control.ki_z = 9.0, 6.0, 5.0
    control.tan_tilt = tan(0.5)
    return control


def test_thrust_and_attitude_give_the_acceleration_that_the_errors_ask_for(position: PositionControl) -> None:
    target, _ = position.step((0.2, -0.1, 0.05), (0.1, 0.2, -0.1), (0.3, 0.1, -0.2), 0.8, LEVEL, None)
    _, thrust = position.step((0.2, -0.1, 0.05), (0.1, 0.2, -0.1), (0.3, 0.1, -0.2), 0.8, target, None)

    acceleration = np.array(to_world(target, (0.0, 0.0, -thrust / 0.5))) + [0, 0, GRAVITY]

    asked = 0.3 + 4 * 0.2 + 3 * 0.1, 0.1 - 4 * 0.1 + 3 * 0.2, -0.2 + 9 * 0.05 - 6 * 0.1
    np.testing.assert_allclose(acceleration, asked, atol=1e-12)
    assert yaw_of(target) == pytest.approx(0.8, abs=0.01)           # first turned, then tilted a little


def test_the_tilt_is_bounded_and_keeps_its_direction(position: PositionControl) -> None:
    target, _ = position.step((30.0, 40.0, 0.0), STILL, STILL, 0.0, LEVEL, None)

    dx, dy, dz = down_axis(target)
    assert acos(dz) == pytest.approx(0.5)
    assert dy / dx == pytest.approx(4 / 3)
    assert dx < 0                               # the thrust, upwards, pushes north


def test_it_never_pushes_down(position: PositionControl) -> None:
    target, thrust = position.step((0.0, 0.0, 50.0), STILL, STILL, 0.0, LEVEL, None)

    assert target == LEVEL
    assert thrust == pytest.approx(LEAST_LIFT * 0.5 * GRAVITY)


def test_the_thrust_is_what_acts_along_the_body_as_it_stands(position: PositionControl) -> None:
    tilted = from_roll_pitch_yaw(0.4, 0.0, 0.0)

    _, thrust = position.step(STILL, STILL, STILL, 0.0, tilted, None)
    _, upside_down = position.step(STILL, STILL, STILL, 0.0, from_roll_pitch_yaw(pi, 0.0, 0.0), None)

    assert thrust == pytest.approx(0.5 * GRAVITY * np.cos(0.4))
    assert upside_down == 0.0


def test_the_integral_grows_with_the_error_is_bounded_rests_and_starts_anew(position: PositionControl) -> None:
    for _ in range(100):
        position.step((0.0, 0.0, 0.02), STILL, STILL, 0.0, LEVEL, 0.01)
    assert position.lift_spared == pytest.approx(5.0 * 0.02 * 1.0)

    for _ in range(10):
        position.step((0.0, 0.0, 10.0), STILL, STILL, 0.0, LEVEL, None)
    assert position.lift_spared == pytest.approx(0.1)

    for _ in range(1000):
        position.step((10.0, 0.0, 10.0), STILL, STILL, 0.0, LEVEL, 0.01)
    assert position.lift_spared == INTEGRAL_MOST
    assert down_axis(position.step(STILL, STILL, STILL, 0.0, LEVEL, None)[0])[2] == 1.0     # the tilt was at its bound
    for _ in range(1000):
        position.step((0.1, 0.0, 0.0), STILL, STILL, 0.0, LEVEL, 0.01)
    tilt = acos(down_axis(position.step(STILL, STILL, STILL, 0.0, LEVEL, None)[0])[2])
    assert tilt == pytest.approx(atan(1.0 * 0.1 * 10.0 / (GRAVITY - INTEGRAL_MOST)))
    position.restart()
    assert position.step(STILL, STILL, STILL, 0.0, LEVEL, None)[0] == LEVEL
    assert position.lift_spared == 0.0
