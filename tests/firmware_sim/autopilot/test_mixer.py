"""The mixer against the plant's own equations of thrust and torque."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_sim.autopilot.airframe import Airframe
from firmware_sim.autopilot.mixer import OFF, Mixer

AIR = Airframe()
LEAST, MOST = (AIR.k_thrust * w**2 for w in (AIR.motor_min_radps, AIR.motor_max_radps))


def wrench(motors: tuple[float, ...]) -> np.ndarray:
    """(thrust, roll, pitch, yaw) in FRD of rotors front, left, back, right, from positions and senses of turning."""
    F = AIR.k_thrust * np.square(motors)
    arms = AIR.arm_m * np.array([[1, 0, 0], [0, -1, 0], [-1, 0, 0], [0, 1, 0]])     # y to the right
    torque = sum(np.cross(arm, [0, 0, -each]) for arm, each in zip(arms, F, strict=True))
    spin = AIR.k_moment / AIR.k_thrust * (F @ [-1, 1, -1, 1])
    return np.array([F.sum(), torque[0], torque[1], torque[2] + spin])


def settled(*asked: float) -> np.ndarray:
    """What motors do in the end: the commands then are the speeds."""
    mixer = Mixer(AIR, 1e-3, 0.02)
    for _ in range(1000):
        motors = mixer.mix(*asked)
    return wrench(motors)


@pytest.mark.parametrize("asked", [(4.9, 0.0, 0.0, 0.0), (4.9, 0.1, -0.05, 0.01), (9.0, -0.2, 0.1, -0.02)])
def test_the_motors_do_what_is_asked_where_they_can(asked: tuple[float, ...]) -> None:
    done = settled(*asked)

    np.testing.assert_allclose(done, asked, atol=1e-9)


@given(st.floats(0, 40), st.floats(-3, 3), st.floats(-3, 3), st.floats(-1, 1))
def test_commands_stay_within_the_motors_whatever_is_asked(thrust: float, roll: float, pitch: float, yaw: float,
                                                           ) -> None:
    mixer = Mixer(AIR, 1e-3, 0.02)

    for _ in range(5):
        motors = mixer.mix(thrust, roll, pitch, yaw)

    assert all(AIR.motor_min_radps <= each <= AIR.motor_max_radps for each in motors)


def test_roll_and_pitch_come_before_thrust_and_thrust_before_yaw() -> None:
    done = settled(4 * MOST, 0.2, -0.1, 0.05)
    np.testing.assert_allclose(done[1:3], (0.2, -0.1), atol=1e-9)
    assert done[0] < 4 * MOST
    assert done[3] < 0.05

    done = settled(0.0, 0.2, -0.1, 0.0)
    np.testing.assert_allclose(done[1:3], (0.2, -0.1), atol=1e-9)
    assert done[0] == pytest.approx(4 * (LEAST + 0.2 / (2 * AIR.arm_m)))

    for sign in (1, -1):
        done = settled(4.9, 0.05, 0.1, sign * 10.0)
        np.testing.assert_allclose(done[:3], (4.9, 0.05, 0.1), atol=1e-9)
        assert 0 < sign * done[3] < 10.0


def test_too_large_a_lever_keeps_its_direction() -> None:
    done = settled(4.9, 6.0, 3.0, 0.0)

    assert done[1] / done[2] == pytest.approx(2.0)


def test_commands_make_slow_motors_follow_with_the_shorter_lag() -> None:
    """A simulated motor with tau = 50 ms reaches 1 - 1/e of a step that stays within limits after 20 ms."""
    mixer, motor = Mixer(AIR, 1e-3, 0.02), AIR.motor_min_radps
    mixer.idle()
    goal = 250.0
    reached = []
    for _ in range(60):
        u = mixer.mix(4 * AIR.k_thrust * goal**2, 0.0, 0.0, 0.0)[0]
        motor += (u - motor) * -math.expm1(-1e-3 / AIR.tau_motor_s)
        reached.append((motor - AIR.motor_min_radps) / (goal - AIR.motor_min_radps))

    # the mixer's model starts at rest, the simulated motor idles: it overshoots by what the model lags
    assert reached[40] > 1 - math.exp(-41 / 20) - 0.05


def test_off_is_off_and_lets_the_modelled_motors_run_down() -> None:
    rested, fresh = Mixer(AIR, 1e-3, 0.02), Mixer(AIR, 1e-3, 0.02)
    for _ in range(200):
        rested.mix(6.0, 0.0, 0.0, 0.0)

    assert {rested.off() for _ in range(2000)} == {OFF}

    assert rested.mix(3.0, 0.0, 0.0, 0.0) == pytest.approx(fresh.mix(3.0, 0.0, 0.0, 0.0), rel=1e-9)


@pytest.mark.parametrize(("wrong", "says"), [
    ({"mass_kg": 0.0}, "mass_kg"), ({"mass_kg": 2.0}, "less than its weight"),
    ({"motor_min_radps": 900.0}, "motor_min"),
    ({"drag_nspm": (-0.1, 0.0)}, "drag_nspm"), ({"drag_nspm": (0.1,)}, "drag_nspm"),
    ({"inertia_kgm2": (1.0, 2.0)}, "three moments"), ({"k_thrust": float("nan")}, "k_thrust"),
])
def test_an_airframe_that_cannot_be_is_refused(wrong: dict, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        Airframe(**wrong)
