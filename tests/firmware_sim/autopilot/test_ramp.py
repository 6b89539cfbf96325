from __future__ import annotations

from math import hypot, log
from random import Random

import pytest

from firmware_sim.autopilot.ramp import CATCH_UP, K_NEAR, Ramp

DT = 0.01


def test_a_long_way_takes_as_long_as_speed_and_braking_allow() -> None:
    """Speeding up at 1.5 a, cruising, braking at a, and a linear end of a / k^2 with time constant 1 / k."""
    speed, accel, way = 1.5, 1.0, 10.0
    ramp, t = Ramp(1), 0.0
    while way - ramp.position[0] > 0.01:
        ramp.step((way,), (None,), speed, accel, DT)
        t += DT

    near = accel / K_NEAR**2
    rise = speed / (CATCH_UP * accel)
    brake_to = K_NEAR * near                            # speed where the linear end begins
    brake = (speed - brake_to) / accel
    cruise = (way - speed * rise / 2 - (speed + brake_to) / 2 * brake - near) / speed
    assert t == pytest.approx(rise + cruise + brake + log(near / 0.01) / K_NEAR, abs=0.05)
    assert ramp.velocity[0] <= speed


def test_speed_and_acceleration_keep_their_bounds_whatever_the_targets_do() -> None:
    rng, ramp = Random("7/targets"), Ramp(2)
    target: tuple[float | None, float | None] = (0.0, 0.0)
    velocity: tuple[float | None, float | None] = (None, None)

    for k in range(5000):
        if k % 37 == 0:
            target = (rng.choice([None, rng.uniform(-5, 5)]), rng.choice([None, rng.uniform(-5, 5)]))
            velocity = (rng.choice([None, rng.uniform(-5, 5)]), None)
        before, place = list(ramp.velocity), list(ramp.position)
        ramp.step(target, velocity, 1.2, 0.8, DT)

        change = [ramp.velocity[i] - before[i] for i in (0, 1)]
        assert hypot(*change) <= CATCH_UP * 0.8 * DT * (1 + 1e-9)
        assert hypot(*ramp.velocity) <= 1.2 + CATCH_UP * 0.8 * DT
        for i in (0, 1):
            assert ramp.position[i] - place[i] == pytest.approx((before[i] + ramp.velocity[i]) / 2 * DT, abs=1e-12)
            assert ramp.acceleration[i] == pytest.approx(change[i] / DT)


def test_it_does_not_overshoot_its_target() -> None:
    ramp, farthest = Ramp(1), 0.0
    for _ in range(1000):
        ramp.step((2.0,), (None,), 3.0, 2.0, DT)
        farthest = max(farthest, ramp.position[0])

    assert farthest <= 2.0 + 1e-3
    assert ramp.position[0] == pytest.approx(2.0, abs=1e-6)


def test_two_axes_go_straight() -> None:
    ramp = Ramp(2)
    for _ in range(200):
        ramp.step((3.0, 1.0), (None, None), 1.0, 1.0, DT)

        assert ramp.position[0] == pytest.approx(3 * ramp.position[1])


def test_without_a_target_it_comes_to_a_stand_and_stays() -> None:
    ramp = Ramp(1)
    ramp.restart((1.0,), (0.9,))
    for _ in range(300):
        ramp.step((None,), (None,), 2.0, 1.0, DT)

    assert ramp.velocity == [0.0]
    assert ramp.position[0] == pytest.approx(1.0 + 0.9**2 / (2 * CATCH_UP), abs=0.01)


def test_a_leash_keeps_the_reference_near() -> None:
    ramp = Ramp(2)
    ramp.restart((3.0, 4.0), (0.0, 0.0))

    ramp.leash((0.0, 0.0), 1.0)

    assert ramp.position == pytest.approx([0.6, 0.8])
