from math import cos, pi, sin

import numpy as np
import pytest
import scipy.optimize
from hypothesis import given
from hypothesis import strategies as st

from agents.tracking.heading_slope import VANISHES_AT, HeadingSlope, heading_table

K2, K3 = 1.2, 1.1
SLOPE = HeadingSlope(K2, K3)


def needed(v, x2, x3, e3):
    """What one point asks of a13: the first row of (4.25) with e1 = e2 = 0 and the terms of x1 aligned or absent."""
    phi = x3 + e3
    sinc = sin(phi) / phi if phi else 1.0
    wanted = abs(v * (cos(phi) - cos(x3)) - K3 * x2 * e3 - K2 * v * sinc * x2 * x2) - K2 * abs(v) * x2 * x2
    return wanted / abs(e3) if e3 else 0.0


@pytest.mark.parametrize(("v", "m2", "m3"), [
    (0.6, 0.2, 0.35), (1.0, 0.25, 0.4), (2.0, 0.3, 0.5), (3.0, 0.25, 0.4), (3.0, 0.0, 0.0), (3.0, 0.0, 2.0),
    (1.0, 3.0, 1.7), (3.0, 0.8, 1.0), (2.0, 1.2, 3.0), (3.0, 1.5, 0.1), (0.0, 1.0, 1.0)])
def test_the_entry_is_the_largest_that_any_point_of_the_box_asks_for(v, m2, m3):
    found = scipy.optimize.differential_evolution(
        lambda z: -needed(v, *z), [(-m2, m2), (-m3, m3), (-12.0, 12.0)], rng=0, maxiter=60, popsize=20, tol=1e-12)
    far = K3 * m2                                       # e3 to infinity
    least = max(-found.fun, far)

    ours = SLOPE(v, m2, m3)

    assert least <= ours * (1 + 1e-8)                   # rounding of a difference of cosines over a small e3
    assert ours <= least + 0.01 * (v + K3 * m2)


@given(st.floats(0, 3), st.floats(-4, 4), st.floats(-20, 20), st.floats(-20, 20))
def test_no_single_point_asks_for_more(v, x2, x3, e3):
    rounding = 1e-13 * (1 + x2 * x2) / max(abs(e3), 1e-300)
    assert needed(v, x2, x3, e3) <= SLOPE(v, abs(x2), abs(x3)) + 1e-12 + rounding


@given(st.floats(0, 3), st.floats(0, 5), st.floats(0, 5))
def test_it_lies_between_the_asymptote_and_the_closed_form(v, m2, m3):
    assert K3 * m2 <= SLOPE(v, m2, m3) <= v + K3 * m2


def test_the_other_sign_of_the_first_row_asks_for_less():
    """D is for v (cos phi - cos x3) < 0; for the other sign the last term of y~ works against, not for it."""
    e3 = np.linspace(0.005, 4 * pi, 1500)
    for Q in (0.0, 0.01, 0.1, 0.5, 1.0, 2.0, 2.9):
        other = largest = 0.0
        for m3 in np.linspace(0, 3 * pi, 160):
            for x3 in (m3, -m3):
                change = np.cos(x3 + e3) - np.cos(x3)
                sinc = np.sinc((x3 + e3) / pi)
                other = max(other, ((change - Q * (1 + sinc)) / e3).max())
                largest = max(largest, ((-change - Q * (1 - sinc)) / e3).max())
            assert other <= largest + 2e-3                  # Q = 0: equal at pi/2, up to the grids


def test_the_table_falls_and_is_convex_in_q_and_rises_with_the_heading():
    table = np.array(heading_table())
    q = VANISHES_AT * np.linspace(0, 1, table.shape[1]) ** 2
    slopes = np.diff(table, axis=1) / np.diff(q)

    assert (np.diff(table, axis=1) <= 0).all()
    assert (np.diff(slopes, axis=1)[:, :-1] >= -2e-3).all()     # all but the last: 0 there, not 0 + GRID_ERROR
    assert (np.diff(table, axis=0) >= 0).all()
    assert table[0, 0] == pytest.approx(0.7246, abs=2e-4)       # max (1 - cos e) / e at tan(e / 2) = e
    assert table[-1, 0] == 1.0


def test_the_table_is_above_what_a_much_finer_grid_finds():
    table = np.array(heading_table())
    phi = np.linspace(0, pi, 4001)[1:]
    for i, j in ((0, 0), (0, 9), (7, 3), (20, 1), (33, 8), (40, 5), (30, 16)):
        Q, found = VANISHES_AT * (j / 32) ** 2, 0.0
        for x3 in np.linspace(0, pi / 2 * i / 64, 10 * 4 * i + 1):
            on = phi[phi > x3 + 1e-9]
            found = max(found, ((cos(x3) - np.cos(on) - Q * (1 - np.sinc(on / pi))) / (on - x3)).max())

        assert found <= table[i, j] <= found + 2.1e-5


def test_from_q_three_on_nothing_is_left():
    phi = np.linspace(-60, 60, 240_001)

    assert (1 - np.cos(phi) <= VANISHES_AT * (1 - np.sinc(phi / pi)) + 1e-12).all()
