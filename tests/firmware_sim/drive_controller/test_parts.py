"""Setpoint watch, ramp, encoder and speed loop, each alone."""

from __future__ import annotations

import math

import pytest

from firmware_sim.drive_controller.drive_messages import DriveState, Mode, Setpoint
from firmware_sim.drive_controller.setpoint_ramp import SetpointRamp
from firmware_sim.drive_controller.setpoint_watch import SetpointWatch
from firmware_sim.drive_controller.speed_loop import SpeedLoop
from firmware_sim.drive_controller.wheel_encoder import WheelEncoder
from netem.wire.level import Level

MS = 1_000_000
RUN, STOP = Setpoint(4.0, -2.0, Mode.RUN, 1), Setpoint(4.0, -2.0, Mode.STOP, 2)


def test_the_watch_goes_through_its_states() -> None:
    watch = SetpointWatch(200 * MS)
    seen = []
    for now_ms, setpoint in [(0, None), (10, RUN), (209, None), (210, None), (400, None), (410, RUN), (420, STOP),
                             (900, None), (910, RUN), (1110, None), (1120, STOP)]:
        if setpoint is not None:
            watch.heard(setpoint, now_ms * MS)
        event = watch.look(now_ms * MS)
        assert event is None or (event[2] is Level.WARNING) == (event[0] == "setpoint stale")
        seen.append((now_ms, watch.state.name, event and event[:2]))

    assert seen == [
        (0, "STOPPED", None), (10, "RUNNING", ("drive running", "")), (209, "RUNNING", None),
        (210, "STALE", ("setpoint stale", "none for 200 ms: the wheels stop")), (400, "STALE", None),
        (410, "RUNNING", ("setpoint recovered", "after 400 ms; the drive is RUNNING")),
        (420, "STOPPED", ("drive stopped", "")), (900, "STOPPED", None), (910, "RUNNING", ("drive running", "")),
        (1110, "STALE", ("setpoint stale", "none for 200 ms: the wheels stop")),
        (1120, "STOPPED", ("setpoint recovered", "after 210 ms; the drive is STOPPED"))]


def test_a_clock_that_is_set_back_makes_nothing_stale_and_no_age_negative() -> None:
    watch = SetpointWatch(200 * MS)
    assert watch.age_ns(5) is None
    watch.heard(RUN, 1000 * MS)
    watch.look(400 * MS)

    assert (watch.state, watch.age_ns(400 * MS), watch.age_ns(1003 * MS)) == (DriveState.RUNNING, 0, 3 * MS)


def test_the_ramp_follows_at_once_and_stops_both_wheels_together_on_their_arc() -> None:
    ramp = SetpointRamp(10.0)
    ramp.follow(DriveState.RUNNING, RUN, 10 * MS)
    assert (ramp.left_radps, ramp.right_radps) == (4.0, -2.0)
    rows = []
    for _ in range(41):
        ramp.follow(DriveState.STALE, RUN, 10 * MS)
        rows.append((ramp.left_radps, ramp.right_radps))

    assert rows[0] == pytest.approx((3.9, -1.95))               # 10 rad/s2 for 10 ms off the faster one
    assert all(right == pytest.approx(-left / 2) for left, right in rows)
    assert rows[38][0] == pytest.approx(0.1)
    assert rows[40] == (0.0, 0.0)
    assert ramp.at_rest


def test_a_running_drive_changes_speed_by_its_ramp_both_wheels_in_proportion() -> None:
    ramp = SetpointRamp(20.0, 10.0)
    rows = []
    for _ in range(41):
        ramp.follow(DriveState.RUNNING, RUN, 10 * MS)
        rows.append((ramp.left_radps, ramp.right_radps))

    assert rows[0] == pytest.approx((0.1, -0.05))
    assert rows[19] == pytest.approx((2.0, -1.0))
    assert rows[40] == (4.0, -2.0)


def test_an_encoder_counts_whole_steps_downwards_too_and_tells_the_mean_speed() -> None:
    encoder = WheelEncoder(1000)
    step = 2 * math.pi / 1000

    encoder.restart(0.5 * step)
    assert (encoder.count, encoder.speed_radps) == (0, 0.0)
    encoder.read(12.5 * step, 10 * MS)
    assert (encoder.count, encoder.speed_radps) == (12, pytest.approx(12 * step / 0.01))
    encoder.read(-0.5 * step, 20 * MS)
    assert (encoder.count, encoder.speed_radps) == (-1, pytest.approx(-13 * step / 0.02))


def test_a_counter_that_wraps_changes_no_speed() -> None:
    encoder = WheelEncoder(1000)
    step = 2 * math.pi / 1000

    encoder.restart((2**31 - 5.5) * step)
    encoder.read((2**31 + 4.5) * step, 10 * MS)

    assert encoder.count == -(2**31) + 4
    assert encoder.speed_radps == pytest.approx(10 * step / 0.01)


def test_the_loop_is_the_sum_of_its_terms() -> None:
    loop = SpeedLoop(kp=0.5, ki=4.0, feedforward=1.1)

    commands = [loop.command(2.0, measured, 10 * MS) for measured in (0.0, 1.0, 2.5)]

    # 1.1 * 2 + 0.5 e + 4 * 0.01 * (sum of e), e = 2, 1, -0.5
    assert commands == pytest.approx([2.2 + 1.0 + 0.08, 2.2 + 0.5 + 0.12, 2.2 - 0.25 + 0.1])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_integral_stands_still_at_the_limit_and_leaves_it_at_once(sign: float) -> None:
    loop = SpeedLoop(kp=0.5, ki=5.0, limit_radps=3.0)

    held = [loop.command(sign * 6.0, sign * 3.0, 10 * MS) for _ in range(1000)]
    integral = loop.integral_radps
    back = loop.command(sign * 1.0, sign * 3.0, 10 * MS)

    assert held == [sign * 3.0] * 1000                          # ten seconds of an error that cannot be removed
    assert integral == 0.0
    assert back == pytest.approx(sign * (1.0 - 1.0 - 0.1))      # feedforward + kp e + ki e dt, e = -2


def test_an_integral_that_helps_out_of_the_limit_goes_on() -> None:
    loop = SpeedLoop(kp=0.0, ki=5.0, limit_radps=3.0)
    loop.integral_radps = 10.0

    loop.command(1.0, 2.0, 10 * MS)

    assert loop.integral_radps == pytest.approx(10.0 - 0.05)


def test_a_loop_that_knows_the_lag_sees_no_error_in_a_wheel_that_has_it() -> None:
    loop = SpeedLoop(kp=0.5, ki=5.0, lag_ns=100 * MS)

    commands = [loop.command(2.0, 2.0 * (1 - math.exp(-k / 10)), 10 * MS) for k in range(50)]

    assert commands == pytest.approx([2.0] * 50, abs=1e-12)
    loop.reset()
    assert loop.command(0.0, 0.0, 10 * MS) == 0.0
