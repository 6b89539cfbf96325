from __future__ import annotations

from math import sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.waves.port import WavePort

positive = st.floats(0.01, 100.0)
numbers = st.floats(-10.0, 10.0)


@given(K=positive, b=positive, y=numbers, w=numbers)
def test_a_port_keeps_the_energy_apart_from_what_its_damper_takes(K, b, y, w):
    port = WavePort(K, b)

    F = port.own_damping * y - port.gain * w
    v = port.gain * y + port.reflection * w

    e = y - F / K                                           # the damper: F = K (y - e)
    scale = 1 + b * (y * y + w * w) + K * y * y
    assert v == pytest.approx((F + b * e) / sqrt(2 * b), abs=1e-9 * scale)
    assert w == pytest.approx((b * e - F) / sqrt(2 * b), abs=1e-9 * scale)
    assert F * y == pytest.approx((v * v - w * w) / 2 + F * F / K, abs=1e-9 * scale)


def test_a_port_whose_damper_is_the_impedance_reflects_nothing():
    assert WavePort(3.0, 3.0).reflection == 0
    assert WavePort(3.0, 3.0).own_damping == 1.5
    assert WavePort(1.0, 3.0).reflection == 0.5


def test_at_rest_a_port_has_no_force_and_its_waves_are_equal():
    port = WavePort(2.0, 7.0)

    w = port.wave_at_rest

    assert port.own_damping - port.gain * w == pytest.approx(0)
    assert port.gain + port.reflection * w == pytest.approx(w)


@pytest.mark.parametrize("value", [0.0, -1.0, float("inf"), float("nan")])
def test_damping_and_impedance_are_positive(value):
    with pytest.raises(ValueError, match=r"damping=.*expected a positive number"):
        WavePort(value, 1.0)
    with pytest.raises(ValueError, match=r"impedance=.*expected a positive number"):
        WavePort(1.0, value)
