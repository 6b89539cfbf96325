"""A differential drive that follows a velocity: it never recedes from where it is to go, and gets there."""

from math import cos, hypot, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.pursuit.steering import STILL_MPS, Steering

STEERING = Steering(0.7, 0.573)
ANGLES = st.floats(-10, 10)


@given(st.floats(STILL_MPS, 3), ANGLES, ANGLES)
def test_it_never_recedes_from_where_it_is_to_go(speed, direction, heading):
    velocity = speed * cos(direction), speed * sin(direction)

    v, _ = STEERING.command(velocity, heading)

    assert v * (cos(heading) * velocity[0] + sin(heading) * velocity[1]) >= -1e-12


@given(st.floats(0, 30), ANGLES, ANGLES)
def test_no_wheel_is_asked_for_more_than_it_can_do(speed, direction, heading):
    v, omega = STEERING.command((speed * cos(direction), speed * sin(direction)), heading)

    assert max(abs(v + side * omega * 0.573 / 2) for side in (-1, 1)) <= 0.7 + 1e-12
    assert abs(omega) <= 1.0


@pytest.mark.parametrize("heading", [0.0, 0.7, 1.5, 2.0, pi, -2.5])
def test_it_gets_to_a_place_whatever_its_heading_is_forwards_or_backwards(heading):
    x, y, turned = 0.0, 0.0, heading
    for _ in range(400):                        # 20 s in steps of 50 ms
        v, omega = STEERING.command((3.0 - x, 1.0 - y), turned)
        turned += omega * 0.05
        x, y = x + v * 0.05 * cos(turned), y + v * 0.05 * sin(turned)

    assert hypot(3.0 - x, 1.0 - y) < 0.05
    assert abs(turned - heading) < pi / 2 + 0.4         # it never turns round


def test_a_goal_that_is_reached_is_no_direction_to_turn_to():
    assert STEERING.command((0.5 * STILL_MPS, 0.0), 1.0) == (0.0, 0.0)


@pytest.mark.parametrize("name", ["v_max_mps", "track_m", "omega_max_radps", "turn_gain_per_s"])
def test_what_makes_no_sense_is_refused(name):
    with pytest.raises(ValueError, match=f"{name}=0.0: expected more than 0"):
        Steering(**({"v_max_mps": 1.0, "track_m": 1.0} | {name: 0.0}))
