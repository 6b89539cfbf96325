"""The rover in C speaks MAVLink as pymavlink understands it, on the host and on the emulated chip."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
from math import cos, inf, nan, pi, remainder, sin
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common

from firmware_sim.firmware.build import INCLUDE, header_options
from firmware_sim.firmware.description import read_description
from firmware_sim.firmware.ids_header import ids_header
from tests.firmware_sim.firmware.rover_bench import FOLDER, MS, Rover, S, inputs

on_chip = pytest.mark.skipif(
    any(importlib.util.find_spec(package) is None for package in ("unicorn", "elftools", "ziglang")),
    reason="needs pip install 'marconet[cortex-m]'")
FLOAT32 = 2**-23                # distance of two numbers, relative
both = pytest.mark.parametrize("target", ["host", pytest.param("cortex_m4", marks=on_chip)])


def kinds(messages):
    return [message.get_type() for message in messages]


@both
def test_it_tells_who_it_is_and_sends_each_stream_at_its_rate(target):
    rover = Rover(target, system=7, component=3, attitude_hz=20.0, position_hz=0.0)

    told = rover.run(2 * S + MS)

    assert {(message.get_srcSystem(), message.get_srcComponent()) for message in told} == {(7, 3)}
    assert [message.get_seq() for message in told] == list(range(len(told)))
    assert {kind: kinds(told).count(kind) for kind in kinds(told)} == {"HEARTBEAT": 2, "SYSTEM_TIME": 2, "ATTITUDE": 40}
    heartbeat = told[kinds(told).index("HEARTBEAT")]
    assert (heartbeat.type, heartbeat.autopilot, heartbeat.mavlink_version) == (common.MAV_TYPE_GROUND_ROVER, 0, 3)
    assert [message.time_boot_ms for message in told if message.get_type() == "ATTITUDE"] == list(range(50, 2001, 50))


@both
def test_parameters_are_listed_read_and_set_within_their_limits(target):
    rover = Rover(target, quiet=True, speed_max_mps=0.75)
    mav = rover.mav

    listed = rover.say(mav.param_request_list_encode(1, 1))
    by_index = rover.say(mav.param_request_read_encode(1, 1, b"", 2))
    by_name = rover.say(mav.param_request_read_encode(1, 0, b"TURN_MAX", -1))
    unknown = rover.say(mav.param_request_read_encode(1, 1, b"TURN", -1), mav.param_request_read_encode(1, 1, b"", 3),
                        mav.param_request_read_encode(1, 1, b"CTRL_TIMEOUT_XYZ", -1))
    answers = [rover.say(mav.param_set_encode(1, 1, b"TURN_MAX", value, kind))[0].param_value
               for value, kind in ((2.5, 9), (nan, 9), (inf, 9), (-0.1, 9), (3.0, 6), (100.5, 9), (0.0, 9))]

    assert [(value.param_id, value.param_value, value.param_index, value.param_count) for value in listed] == [
        ("SPEED_MAX", 0.75, 0, 3), ("TURN_MAX", 1.0, 1, 3), ("CTRL_TIMEOUT", 0.5, 2, 3)]
    assert [value.param_id for value in by_index + by_name] == ["CTRL_TIMEOUT", "TURN_MAX"]
    assert unknown == []
    assert answers == [2.5, 2.5, 2.5, 2.5, 2.5, 2.5, 0.0]


@both
def test_commands_are_carried_out_or_refused_and_each_is_answered(target):
    rover = Rover(target, quiet=True)

    asked = rover.say(rover.mav.command_long_encode(1, 1, 512, 0, 30, 0, 0, 0, 0, 0, 0))
    results = [rover.command(*command) for command in (
        (512, 33), (512, nan), (512, -1), (511, 30, 250_000), (511, 33, 1000), (511, 30, nan), (511, 30, -2),
        (400, 1), (400, 0.5), (22,))]
    told = rover.run(S)
    as_int = rover.say(rover.mav.command_int_encode(1, 1, 0, 400, 0, 0, 0, 0, 0, 0, 0, 0, 0))

    assert kinds(asked) == ["ATTITUDE", "COMMAND_ACK"]
    assert results == [3, 3, 3, 0, 3, 2, 2, 0, 2, 3]
    assert kinds(told) == ["ATTITUDE"] * 4
    assert [ack.result for ack in as_int] == [common.MAV_RESULT_COMMAND_LONG_ONLY]


@both
def test_ping_and_timesync_are_answered_and_their_answers_are_not(target):
    rover = Rover(target, quiet=True)
    mav = rover.mav
    at_ns = rover.now_ns

    (ping,) = rover.say(mav.ping_encode(123, 5, 0, 0))
    (sync,) = rover.say(mav.timesync_encode(0, 77))
    answers = rover.say(mav.ping_encode(123, 5, 1, 1), mav.timesync_encode(9, 77))

    assert (ping.time_usec, ping.seq, ping.target_system, ping.target_component) == (123, 5, 255, 190)
    assert (sync.tc1, sync.ts1) == (at_ns + MS, 77)
    assert answers == []


@both
def test_it_drives_by_manual_control_and_tells_where_it_is(target):
    rover = Rover(target, quiet=True, control_timeout_s=0.25)
    mav = rover.mav
    rover.say(mav.manual_control_encode(1, 1000, 0, 0, 0, 0))
    assert rover.command(400, 1) == 0
    start_ns = rover.now_ns
    for _ in range(10):
        rover.say(mav.manual_control_encode(1, 1000, 0, 0, 500, 0))
        rover.run(99 * MS)
    times_s, told = [], []
    for number in (30, 32, 32):
        times_s.append((rover.now_ns - start_ns) * 1e-9)
        told += rover.say(mav.command_long_encode(1, 1, 512, 0, number, 0, 0, 0, 0, 0, 0))[:1]
    rover.say(mav.manual_control_encode(1, 1001, 0, 0, 0, 0), mav.manual_control_encode(2, 0, 0, 0, 0, 0))
    rover.run(S)

    attitude, before, position = told
    theta = 0.5 * times_s[2]                        # 0.5 m/s and 0.5 rad/s: a circle with a radius of 1 m
    north_m, east_m = 1.0 - cos(theta), sin(theta)
    middle = (theta + 0.5 * times_s[1]) / 2
    assert (attitude.yaw, attitude.yawspeed) == pytest.approx((pi / 2 - 0.5 * times_s[0], -0.5), rel=FLOAT32)
    assert (position.x, position.y) == pytest.approx((north_m, east_m), rel=FLOAT32)
    assert (position.vx, position.vy) == pytest.approx((0.5 * sin(middle), 0.5 * cos(middle)), rel=1e-6)    # a chord
    assert (before.vx, before.vy) == (0.0, 0.0)     # nothing was told earlier
    assert rover.plant.get("v") == 0.0
    assert rover.events == ["armed", "no manual control"]
    assert rover.counters["controls refused"] == 2


def test_an_angle_is_told_between_minus_pi_and_pi():
    rover = Rover(quiet=True, turn_max_radps=10.0, control_timeout_s=60.0)
    rover.command(400, 1)
    start_ns = rover.now_ns
    rover.say(rover.mav.manual_control_encode(1, 0, 0, 0, 1000, 0))
    for _ in range(50):
        rover.run(100 * MS)
        theta = 10.0 * (rover.now_ns - start_ns) * 1e-9
        told = rover.say(rover.mav.command_long_encode(1, 1, 512, 0, 30, 0, 0, 0, 0, 0, 0))[0]

        assert -pi <= told.yaw <= pi
        assert remainder(told.yaw - (pi / 2 - theta), 2 * pi) == pytest.approx(0.0, abs=pi * FLOAT32)


def test_messages_for_others_are_counted_and_not_answered():
    rover = Rover(quiet=True)
    mav = rover.mav

    told = rover.say(mav.param_request_list_encode(2, 1), mav.param_request_list_encode(1, 2),
                     mav.command_long_encode(2, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))

    assert told == []
    assert rover.counters["messages for others"] == 3


def test_a_message_may_come_in_pieces_and_behind_noise():
    rover = Rover(quiet=True)
    data = rover.mav.ping_encode(1, 2, 0, 0).pack(rover.mav)

    early = rover.hear(b"noise \xfe" + bytes(20) + data[:9])
    late = rover.hear(data[9:])

    assert (kinds(early), kinds(late)) == ([], ["PING"])


def after_a_thousand_hostile_inputs(target):
    rover = Rover(target)
    for data in inputs(1000):
        rover.hear(data)
    rover.hear(bytes(600))                      # the end of whatever was begun
    return rover


def test_a_thousand_hostile_inputs_do_no_harm():
    rover = after_a_thousand_hostile_inputs("host")

    assert "PING" in kinds(rover.say(rover.mav.ping_encode(1, 2, 0, 0)))
    assert {name for name, count in rover.counters.items() if count > 10} == {
        "messages taken", "messages for others", "parse errors", "controls refused"}


@on_chip
def test_the_chip_sends_what_the_host_sends_whatever_comes():
    host, chip = map(after_a_thousand_hostile_inputs, ("host", "cortex_m4"))

    assert chip.counters.pop("instructions") > 1_000_000
    assert all(chip.counters.pop(name) > 0 for name in ("flash bytes", "RAM bytes", "stack bytes"))
    assert (chip.sent, chip.counters, chip.events) == (host.sent, host.counters, host.events)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc with its sanitizers")
def test_ten_thousand_hostile_inputs_and_no_word_of_the_sanitizers(tmp_path):
    firmware = read_description(FOLDER)
    (tmp_path / "board_ids.h").write_text(ids_header(firmware))
    command = ["gcc", "-std=c99", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover", f"-I{INCLUDE}", "-I.",
               *header_options(FOLDER, firmware), "-o", "rover", *map(str, FOLDER.glob("*.c")),
               str(Path(__file__).with_name("stdin_board.c"))]
    subprocess.run(command, cwd=tmp_path, check=True)

    frames = b"".join(len(data).to_bytes(2, "little") + data for data in inputs(10_000, seed=3))
    done = subprocess.run([tmp_path / "rover"], input=frames, capture_output=True, timeout=60)

    assert done.stderr == b""
    assert int(done.stdout) > 1000
