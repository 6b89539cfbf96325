from math import cos, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.tracking.controller import Inputs, TrackingController
from agents.tracking.error_dynamics import error_rate, state_rate, y_tilde

CONTROLLER = TrackingController()
K1, K2, K3 = 1.5, 1.2, 1.1

metres = st.floats(-5, 5)
speeds = st.floats(-3, 3)
small = st.floats(-0.3, 0.3)


@given(metres, metres, metres, metres, metres, metres, speeds, speeds, small, small)
def test_the_error_dynamics_are_those_printed(x1, x2, x3, e1, e2, e3, v, omega, dv, domega):
    P = K2 * v * np.sinc((x3 + e3) / np.pi)                                                         # below (4.47)
    Q, R, S, T = omega * x2, v * cos(x3 + e3), (v - dv) * cos(x3), (v - dv) * sin(x3)
    printed = (-Q - P * (x2 + e2) * x2 - K3 * (x3 + e3) * x2 + R + K1 * (x1 + e1) - S,              # (4.46)
               omega * x1 + P * (x2 + e2) * x1 + K3 * (x3 + e3) * x1 - T,
               domega + P * (x2 + e2) + K3 * (x3 + e3))

    ours = error_rate(CONTROLLER, (x1, x2, x3), (e1, e2, e3), Inputs(v, omega), Inputs(dv, domega))

    np.testing.assert_allclose(ours, printed, rtol=1e-9, atol=1e-9)


@given(metres, metres, metres, speeds, speeds, small, small)
def test_the_output_bounds_the_error_dynamics_at_zero_error(x1, x2, x3, v, omega, dv, domega):
    x, held, off = (x1, x2, x3), Inputs(v, omega), Inputs(dv, domega)

    rate = error_rate(CONTROLLER, x, (0.0, 0.0, 0.0), held, off)

    assert (np.abs(rate) <= np.array(y_tilde(CONTROLLER, x, held, off)) + 1e-9).all()


def test_a_robot_on_its_reference_stays_there():
    inputs = Inputs(1.0, 0.5)

    assert state_rate((0.0, 0.0, 0.0), CONTROLLER.command((0.0, 0.0, 0.0), inputs), inputs) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("k", [2.0, 10.0, 1e4])
def test_the_state_is_not_detectable_with_any_k_for_slow_references(k):
    """Section 4.6: "||x||^2 <= k (||y~||^2 + ||(e, e_omega)||^2) for any k >= 2"."""
    x, held, nothing = (0.0, 1e-3, 0.0), Inputs(0.5 / (K2 * k**0.5), 0.0), Inputs(0.0, 0.0)

    output = np.array(y_tilde(CONTROLLER, x, held, nothing))

    assert np.dot(x, x) > k * np.dot(output, output)


def test_with_a_reference_that_stands_still_the_output_does_not_see_x2_at_all():
    assert y_tilde(CONTROLLER, (0.0, 7.0, 0.0), Inputs(0.0, 0.0), Inputs(0.0, 0.0)) == (0.0, 0.0, 0.0)
