"""Commands within the drive's limits: the faster wheel at its limit, the arc that of (4.4)."""

from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.tracking.controller import Inputs, TrackingController
from agents.tracking.drive_limits import LimitedController, rim_speed
from agents.triggering.assumptions import command_violations

TRACK_M = 0.573


@given(st.tuples(*[st.floats(-5, 5)] * 3), st.floats(-3, 3), st.floats(-3, 3))
def test_a_command_is_that_of_the_law_or_slower_on_the_same_arc(x, v, omega):
    limited = LimitedController(speed_max_mps=0.7, track_m=TRACK_M)

    wanted, driven = TrackingController().command(x, Inputs(v, omega)), limited.command(x, Inputs(v, omega))

    left, right = (driven.v_mps + side * driven.omega_rad_s * TRACK_M / 2 for side in (-1, 1))
    assert max(abs(left), abs(right)) <= 0.7 * (1 + 1e-12)
    assert driven.v_mps * wanted.omega_rad_s == pytest.approx(driven.omega_rad_s * wanted.v_mps, abs=1e-12)
    if rim_speed(wanted, TRACK_M) <= 0.7:
        assert driven == wanted
    else:
        assert max(abs(left), abs(right)) == pytest.approx(0.7)


def test_a_command_beyond_the_limit_is_a_violation():
    found, = command_violations(3, 0.9, 0.7)

    assert str(found) == "command: it needs 0.9 m/s of a wheel's rim, which turns at 0.7 m/s at most"
    assert command_violations(3, 0.7, 0.7) == []


@pytest.mark.parametrize("limits", [{"speed_max_mps": 0.0}, {"speed_max_mps": inf}, {"track_m": -1.0},
                                    {"k1_per_s": 0.0}])
def test_limits_that_are_none_are_refused(limits):
    with pytest.raises(ValueError, match=next(iter(limits))):
        LimitedController(**limits)
