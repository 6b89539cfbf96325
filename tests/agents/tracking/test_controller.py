from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.tracking.controller import Command, Inputs, Pose, TrackingController, tracking_error

metres = st.floats(-10, 10)
radians = st.floats(-4, 4)


@given(metres, metres, radians, metres, metres, radians)
def test_the_tracking_error_is_the_reference_seen_from_the_robot(x, y, theta, x_ref, y_ref, theta_ref):
    rotation = np.array([[cos(theta), sin(theta), 0], [-sin(theta), cos(theta), 0], [0, 0, 1]])     # (4.2)

    seen = tracking_error(Pose(x, y, theta), Pose(x_ref, y_ref, theta_ref))

    np.testing.assert_allclose(seen, rotation @ [x_ref - x, y_ref - y, theta_ref - theta], atol=1e-12)


@given(metres, metres, radians, st.floats(-3, 3), st.floats(-3, 3))
def test_the_command_is_that_of_the_printed_law(x1, x2, x3, v, omega):
    command = TrackingController().command((x1, x2, x3), Inputs(v, omega))

    assert command.v_mps == pytest.approx(v * cos(x3) + 1.5 * x1)
    assert command.omega_rad_s == pytest.approx(omega + 1.2 * v * np.sinc(x3 / pi) * x2 + 1.1 * x3)


def test_without_an_error_the_robot_drives_what_the_reference_drives():
    assert TrackingController().command((0.0, 0.0, 0.0), Inputs(1.3, -0.4)) == Command(1.3, -0.4)


def test_a_heading_error_near_zero_is_no_division_by_zero():
    for x3 in (0.0, -0.0, 5e-324, 1e-9):
        turn = TrackingController().command((0.0, 1.0, x3), Inputs(1.0, 0.0)).omega_rad_s
        assert turn == pytest.approx(1.2, abs=1e-8)


@pytest.mark.parametrize("gain", [0.0, -1.0, float("inf"), float("nan")])
def test_gains_that_do_not_pull_are_refused(gain):
    with pytest.raises(ValueError, match=r"k2_per_m2=.*: the gains of \(4\.4\) are positive"):
        TrackingController(k2_per_m2=gain)
