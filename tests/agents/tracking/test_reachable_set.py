from itertools import pairwise, product
from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from agents.tracking.controller import Command, Inputs
from agents.tracking.reachable_set import extents_until

LIMITS = Inputs(3.0, 3.0)
NOISE = 0.15

states = st.tuples(st.floats(-10, 10), st.floats(-10, 10), st.floats(-4, 4))
commands = st.builds(Command, st.floats(-18, 18), st.floats(-40, 40))


def driven(x, command, inputs, tau_s, n):
    """The tracking error along its way, (n + 1, 3): both robots in the plane, R2 with inputs[k] on step k."""
    h = tau_s / n
    (px, py, own), (rx, ry, other) = (0.0, 0.0, 0.0), x
    path = [x]
    for k in range(n):
        for v, omega, robot in ((*command, 1), (*inputs[k], 2)):
            a = omega * h / 2
            chord = v * h * (sin(a) / a if a else 1.0)
            if robot == 1:
                px, py, own = px + chord * cos(own + a), py + chord * sin(own + a), own + 2 * a
            else:
                rx, ry, other = rx + chord * cos(other + a), ry + chord * sin(other + a), other + 2 * a
        c, s = cos(own), sin(own)
        path.append((c * (rx - px) + s * (ry - py), c * (ry - py) - s * (rx - px), other - own))
    return np.array(path)


@given(states, commands, st.tuples(*[st.floats(-1, 1)] * 3), st.floats(0.001, 0.1), st.integers(0, 2**32 - 1))
@example((0.0, 0.0, 0.0), Command(0.0, 0.0), (1.0, 1.0, 1.0), 0.045, 0)
@example((5.0, 0.1, 1.5), Command(0.5, -30.0), (1.0, -1.0, 1.0), 0.05, 1)
def test_no_way_of_both_robots_leaves_the_set(x, command, nu, tau_s, seed):
    rng = np.random.default_rng(seed)
    n = 12
    true_x = tuple(y - NOISE * s for y, s in zip(x, nu, strict=True))
    wild = rng.uniform(-1, 1, (n, 2))
    inputs = 3.0 * (np.sign(wild) if seed % 2 else wild)

    path = np.abs(driven(true_x, command, inputs, tau_s, n))

    extents = extents_until(x, command, LIMITS, NOISE)
    for k in range(n + 1):
        assert (path[:k + 1].max(axis=0) <= np.array(extents(tau_s * k / n)) + 1e-9).all()


@given(states, commands, st.floats(1e-4, 0.1))
@example((0.5, -0.8133374909519002, 0.0), Command(8.0, 6e-8), 0.0625)           # hardly an arc: a circle of 1e8 m
@example((0.5, -0.8133374909519002, 0.0), Command(8.0, -1e-13), 0.0625)
def test_without_noise_and_with_a_standing_reference_it_is_the_arc_itself(x, command, tau_s):
    arc = np.abs(driven(x, command, [(0.0, 0.0)] * 400, tau_s, 400)).max(axis=0)

    m1, m2, m3 = extents_until(x, command, Inputs(0.0, 0.0), 0.0)(tau_s)

    turned = abs(command.omega_rad_s) * tau_s
    if turned < pi / 2:                     # beyond, the whole circle stands for the arc
        between = (command.omega_rad_s * np.hypot(*x[:2]) + command.v_mps) * tau_s / 400 * turned / 400
        np.testing.assert_allclose([m1, m2], arc[:2], rtol=1e-9, atol=abs(between) + 1e-9)
    assert m1 >= arc[0] - 1e-9
    assert m2 >= arc[1] - 1e-9
    assert m3 == pytest.approx(arc[2], abs=1e-9)


@given(states, commands, st.floats(1e-3, 0.1))
def test_the_box_that_noise_makes_turns_with_the_robot(x, command, tau_s):
    corners = [tuple(y + NOISE * s for y, s in zip(x, signs, strict=True)) for signs in product((-1, 1), repeat=3)]
    reached = np.max([np.abs(driven(corner, command, [(0.0, 0.0)] * 50, tau_s, 50)).max(axis=0) for corner in corners],
                     axis=0)

    extents = np.array(extents_until(x, command, Inputs(0.0, 0.0), NOISE)(tau_s))

    assert (reached <= extents + 1e-9).all()


@given(states, commands, st.lists(st.floats(0, 0.2), min_size=2, max_size=6))
def test_a_longer_time_never_reaches_less(x, command, taus_s):
    extents = extents_until(x, command, LIMITS, NOISE)

    found = [extents(tau_s) for tau_s in sorted(taus_s)]

    for k in range(3):
        sizes = [m[k] for m in found]
        assert all(a <= b + 1e-9 for a, b in pairwise(sizes))


def test_at_once_only_the_noise_is_added():
    assert extents_until((1.0, -2.0, 0.5), Command(1.0, 1.0), LIMITS, NOISE)(0.0) == pytest.approx((1.15, 2.15, 0.65))


def test_a_reference_straight_ahead_reaches_as_far_as_it_can_drive_and_hardly_aside():
    m1, m2, m3 = extents_until((0.0, 0.0, 0.0), Command(0.0, 0.0), LIMITS, NOISE)(0.04)

    assert m1 == pytest.approx(NOISE + 3 * 0.04)                        # attained: x1 = 0.15, R2 straight on at 3 m/s
    assert m2 == pytest.approx(NOISE + 3 * 0.04 * sin(NOISE + 3 * 0.04))
    assert m3 == pytest.approx(NOISE + 3 * 0.04)


def test_the_set_is_not_much_larger_than_what_can_be_reached():
    """The sum of sharp bounds, against the best of many extreme ways, where a tracking robot mostly is."""
    rng = np.random.default_rng(1)
    for x, command in (((0.1, -0.1, 0.1), Command(1.1, 1.2)), ((3.0, 3.0, pi / 2), Command(4.5, 5.0))):
        reached = np.zeros(3)
        for _ in range(800):
            true_x = np.array(x) + NOISE * rng.choice([-1, 1], 3)
            inputs = np.repeat(3.0 * rng.choice([-1.0, 1.0], (1, 2)), 10, axis=0)
            reached = np.maximum(reached, np.abs(driven(tuple(true_x), command, inputs, 0.03, 10)).max(axis=0))

        excess = np.array(extents_until(x, command, LIMITS, NOISE)(0.03)) - reached
        assert (excess[:2] <= 3 * 0.03 + NOISE * command.omega_rad_s * 0.03).all()      # R2's way, noise turned
        assert excess[2] == pytest.approx(0.0, abs=1e-9)
