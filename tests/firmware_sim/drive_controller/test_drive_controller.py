"""The drive controller's board: its timing on its own clock, its loop, its silence, whatever comes over the wire."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from random import Random
from types import SimpleNamespace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from firmware_sim.board import Board, NoPlant
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.drive_controller.drive_controller import DriveController
from firmware_sim.drive_controller.drive_messages import (
    NO_AGE_MS,
    DriveState,
    Mode,
    Odometry,
    Setpoint,
    Status,
    WheelSpeeds,
)
from firmware_sim.drive_controller.drive_settings import DriveSettings
from firmware_sim.local_clock import LocalClock
from firmware_sim.scenario_view import OwnAgent
from netem.media.can.frame import CanFrame, MalformedFrame, pack, unpack
from netem.node.node import Node
from tests.examples import examples

MS = 1_000_000
Bench = Callable[..., "DriveBench"]             # noqa: F821  (of conftest.py)
OPEN_LOOP = {"kp": 0.0, "ki": 0.0}              # on an ideal plant the wheels then do just what the setpoint says


def run(left: float, right: float, counter: int = 1) -> Setpoint:
    return Setpoint(left, right, Mode.RUN, counter)


def repeated(drive, setpoint: Setpoint, until_ns: int, since_ns: int = 5 * MS, every_ns: int = 50 * MS):
    for at_ns in range(since_ns, until_ns, every_ns):
        drive.hears(at_ns, setpoint)
    return drive


# --- timing


def test_outputs_appear_an_execution_time_after_their_release_on_the_local_clock(bench: Bench) -> None:
    clock = ClockSettings(offset_ns=3 * MS, drift_ppm=200.0, tick_ns=1000)
    drive = bench({}, clock, period_ns=5 * MS, offset_ns=MS, execution_ns=400_000).until(1000 * MS)
    local = drive.clock

    heard = [time_ns for time_ns, _ in drive.said(WheelSpeeds)]

    # local time is 3 ms at the start, so the first release is at 6 ms
    assert heard[:100] == [local.true_at(6 * MS + 5 * MS * k + 400_000) for k in range(100)]
    assert len(heard) == 200                    # (1000 ms (1 + 2e-4) + 3 ms - 6.4 ms) / 5 ms, and the first one
    assert [time_ns for time_ns, _ in drive.said(Odometry)] == heard


def test_a_setpoint_acts_in_the_first_release_after_it_when_that_ones_outputs_appear(bench: Bench) -> None:
    drive = bench({}, period_ns=10 * MS, execution_ns=2 * MS, **OPEN_LOOP)
    drive.hears(10 * MS + 1, run(3.0, 5.0))     # after the release at 10 ms, before its outputs at 12 ms

    wheels = [drive.until(end_ns).wheels() for end_ns in (12 * MS + 1, 20 * MS + 1, 22 * MS, 22 * MS + 1)]

    assert wheels == [(0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (3.0, 5.0)]


def test_odometry_and_status_come_at_their_own_rates_and_in_order(bench: Bench) -> None:
    drive = bench({}, period_ns=2 * MS, execution_ns=100_000, odometry_every=5, status_every=4).until(100 * MS)

    times = [[time_ns for time_ns, _ in drive.said(kind)] for kind in (WheelSpeeds, Odometry, Status)]

    assert times[0] == times[1] == [100_000 + 10 * MS * k for k in range(10)]
    assert times[2] == [100_000, 100_000 + 40 * MS, 100_000 + 80 * MS]
    assert [int.from_bytes(data[:4], "little") for _, data in drive.offers[:5]] == [0x190, 0x1A0, 0x710, 0x190, 0x1A0]


def test_the_promise_reaches_to_the_next_publication_whatever_is_heard(bench: Bench) -> None:
    drive = bench({}, period_ns=2 * MS, execution_ns=100_000, odometry_every=5)
    promised = []
    for end_ns in range(MS, 60 * MS, MS):
        drive.hears(end_ns - 1, run(1.0, 1.0)).until(end_ns)
        promised.append(drive.firm_ns)

    said = [time_ns for time_ns, _ in drive.offers]
    assert promised == [100_000 + 10 * MS * math.ceil((end_ns - 100_000) / (10 * MS))
                        for end_ns in range(MS, 60 * MS, MS)]
    assert said                                 # Node.offer raises if one of them breaks a promise


def test_a_clock_that_is_stepped_breaks_no_promise_and_counts_what_it_missed(bench: Bench) -> None:
    steps = ((43 * MS, 25 * MS), (100 * MS + 50_000, -33 * MS))
    drive = bench({}, ClockSettings(), steps, period_ns=10 * MS, **OPEN_LOOP)
    repeated(drive, run(2.0, 2.0), 400 * MS, every_ns=20 * MS).until(400 * MS)

    # the timer for 50 ms was armed before the step and rings at a reading of 75 ms: 60 and 70 ms are jumped over
    assert drive.counters["releases missed"] == 2
    assert [kind for _, kind, _ in drive.events] == ["drive running"]
    speeds = [message.left_radps for _, message in drive.said(WheelSpeeds)][3:]
    step = 2 * math.pi / 16384 / 0.01
    wrong = [speed for speed in speeds if abs(speed - 2.0) > step]
    # 10 ms taken for 35 ms, and 43 ms (10 + 33) for 10 ms: a firmware that trusts its clock cannot know better
    assert wrong == pytest.approx([2.0 * 10 / 35, 2.0 * 43 / 10], abs=step)
    assert drive.wheels() == (2.0, 2.0)


# --- the loop


@pytest.mark.parametrize("plant", [
    {"tau_wheel_s": 0.1, "gain_left": 0.8, "gain_right": 1.2},
    {"tau_wheel_s": 0.1, "accel_max_mps2": 1.0, "gain_left": 1.3},
    {},
])
def test_the_loop_takes_away_what_the_motors_do_wrong(plant: dict[str, float], bench: Bench) -> None:
    drive = repeated(bench(plant, counts_per_turn=65_536), run(4.0, -2.5), 5000 * MS).until(5000 * MS)

    # the integral acts until the mean of the readings is right: within a step of the encoder over one period
    step = 2 * math.pi / 65_536 / 0.01
    assert drive.wheels() == pytest.approx((4.0, -2.5), abs=1.5 * step)
    (_, last) = drive.said(WheelSpeeds)[-1]
    assert (last.left_radps, last.right_radps) == pytest.approx((4.0, -2.5), abs=2 * step)


def test_the_loop_agrees_with_the_recursion_written_out(bench: Bench) -> None:
    """An ideal plant under an open command: u_k = r + kp (r - w_(k-1)) + ki T sum of errors, w the encoder's mean."""
    kp, ki, T, execution = 0.3, 2.0, 0.01, 0.003
    drive = bench({"wheel_left": 0.0}, kp=kp, ki=ki, execution_ns=3 * MS, counts_per_turn=2**24)
    repeated(drive, run(1.0, 1.0), 300 * MS, since_ns=MS)
    angle, count, command, integral, expected = 0.0, 0, 0.0, 0.0, []
    step = 2 * math.pi / 2**24
    for k in range(30):
        now = math.floor(angle / step)
        measured, count = step * (now - count) / T if k else 0.0, now
        if k:                                               # heard at 1 ms, after release 0
            integral += ki * T * (1.0 - measured)
            new = 1.0 + kp * (1.0 - measured) + integral
        else:
            new = 0.0
        angle += command * execution + new * (T - execution)
        command = new
        expected.append(command)

    seen = [drive.until(k * 10 * MS + 3 * MS + 1).wheels()[0] for k in range(30)]

    assert seen == pytest.approx(expected, abs=1e-4)        # where a floor falls to the other side: step / T = 4e-5


def test_the_command_keeps_to_its_limit_and_the_loop_recovers_from_it_at_once(bench: Bench) -> None:
    drive = bench({"tau_wheel_s": 0.05}, command_max_radps=3.0)
    repeated(drive, run(10.0, 1.0), 2000 * MS).until(2000 * MS)
    limited = drive.wheels()[0]
    repeated(drive, run(1.0, 1.0), 3000 * MS, since_ns=2000 * MS).until(2100 * MS)
    (_, soon) = drive.said(WheelSpeeds)[-1]

    assert limited == pytest.approx(3.0, abs=1e-6)
    assert soon.left_radps < 1.5                            # 100 ms = 2 tau later; a wound-up integral would hold 3.0


def overshoot(drive) -> float:
    repeated(drive, run(4.0, 4.0), 1000 * MS)
    return max(drive.until(end_ns).wheels()[0] for end_ns in range(10 * MS, 1000 * MS, 10 * MS)) - 4.0


def test_a_drive_that_knows_its_wheels_lag_hardly_overshoots(bench: Bench) -> None:
    plant = {"tau_wheel_s": 0.1}

    # What is left: a reading is the mean of a period and the command comes 0.3 ms late, 5.3 ms of lag that the loop
    # does not know. It sees at most 40 rad/s2 * 5.3 ms = 0.21 rad/s less than there is, and kp / (1 + kp) of it acts
    assert overshoot(bench(plant, lag_ns=100 * MS)) < 0.21 / 3
    assert overshoot(bench(plant)) > 0.4


def test_motors_that_are_not_asked_for_more_than_they_can_do_not_overshoot(bench: Bench) -> None:
    """0.3 m/s2 at a radius of 0.1 m is 3 rad/s2: asked for 2.9, the wheels follow with their lag alone."""
    plant = {"tau_wheel_s": 0.1, "accel_max_mps2": 0.3}

    def highest(**settings: float) -> float:
        drive = repeated(bench(plant, lag_ns=100 * MS, **settings), run(4.0, 4.0), 3000 * MS)
        return max(drive.until(end_ns).wheels()[0] for end_ns in range(10 * MS, 3000 * MS, 10 * MS))

    assert highest(ramp_radps2=2.9) < 4.0 + 0.02            # 2.9 rad/s2 * 5.3 ms of lag that the loop does not know
    assert highest() > 4.2


def test_a_drive_that_stops_does_not_creep_back(bench: Bench) -> None:
    drive = repeated(bench({"tau_wheel_s": 0.1}, stale_after_ns=100 * MS), run(4.0, 2.0), 1000 * MS)

    wheels = [drive.until(end_ns).wheels() for end_ns in range(1050 * MS, 4000 * MS, 10 * MS)]

    # heard last at 955 ms, stale at 1060 ms, ramp of 0.2 s
    assert min(min(pair) for pair in wheels) >= -0.05
    assert all(pair == pytest.approx((0.0, 0.0), abs=4 * math.exp(-(k - 21) / 10)) for k, pair in enumerate(wheels))


def test_a_drive_that_stood_starts_without_what_its_loop_had_learned(bench: Bench) -> None:
    """Motors at half their gain: the integral holds half the command while running, and is gone after a stop."""
    drive = repeated(bench({"gain_left": 0.5, "gain_right": 0.5}), run(4.0, 4.0), 3000 * MS)
    drive.hears(3000 * MS, Setpoint(0.0, 0.0, Mode.STOP, 2)).hears(4005 * MS, run(1.0, 1.0)).until(4010 * MS + 300_001)

    # 0.5 (feedforward + kp error + ki error period), error 1
    assert drive.wheels() == pytest.approx((0.5 * (1 + 0.5 + 0.05),) * 2, abs=1e-9)


def test_odometry_counts_what_the_wheels_turned_slip_or_not(bench: Bench) -> None:
    drive = bench({"slip_left": 1.0}, counts_per_turn=1000, **OPEN_LOOP)
    repeated(drive, run(2.0, -2.0), 2000 * MS).until(2000 * MS)

    (time_ns, last) = drive.said(Odometry)[-1]

    # commanded from 10.3 ms on, sampled at the release 0.3 ms before the frame
    turned = 2.0 * ((time_ns - 300_000) - 10_300_000) / 1e9
    assert last == (math.floor(turned / (2 * math.pi) * 1000), math.floor(-turned / (2 * math.pi) * 1000))


# --- silence


def test_a_setpoint_that_goes_stale_stops_the_wheels_and_recovers_with_an_event(bench: Bench) -> None:
    drive = bench({}, stale_after_ns=105 * MS, stop_ramp_radps2=20.0, **OPEN_LOOP)
    drive.hears(13 * MS, run(4.0, 2.0, 7)).hears(600 * MS, run(1.0, 1.0, 8)).until(700 * MS)

    # heard at 13 ms, stale at 118 ms, noticed at the release at 120 ms; fresh at 600 ms, which is a release already
    assert drive.events == [
        (20 * MS, "drive running", ""), (120 * MS, "setpoint stale", "none for 107 ms: the wheels stop"),
        (600 * MS, "setpoint recovered", "after 587 ms; the drive is RUNNING")]
    states = [(time_ns, message.state) for time_ns, message in drive.said(WheelSpeeds)]
    assert {state for time_ns, state in states if 20 * MS < time_ns < 120 * MS} == {DriveState.RUNNING}
    assert {state for time_ns, state in states if 120 * MS < time_ns < 600 * MS} == {DriveState.STALE}
    # ramp of 0.2 rad/s a period for the faster wheel: zero after 20 periods, with both wheels in proportion
    speeds = dict(drive.said(WheelSpeeds))
    half_way = speeds[220 * MS + 300_000]
    assert half_way.left_radps == pytest.approx(2 * half_way.right_radps, abs=2 * 2 * math.pi / 16384 / 0.01)
    assert 1.8 < half_way.left_radps < 2.3
    assert (speeds[350 * MS + 300_000].left_radps, speeds[350 * MS + 300_000].right_radps) == (0.0, 0.0)
    assert drive.wheels() == (1.0, 1.0)


def test_the_age_of_the_setpoint_runs_on_the_local_clock(bench: Bench) -> None:
    fast = bench({}, ClockSettings(drift_ppm=100_000.0), stale_after_ns=220 * MS)
    fast.hears(0, run(1.0, 1.0)).until(400 * MS)

    (at_ns, kind, _) = fast.events[1]

    assert kind == "setpoint stale"
    assert at_ns == 200 * MS                    # 220 ms on a clock that is 10 % fast, and a release there


def test_who_is_told_to_stop_ramps_down_and_may_be_left_alone(bench: Bench) -> None:
    drive = bench({}, stale_after_ns=100 * MS, **OPEN_LOOP)
    drive.hears(5 * MS, run(2.0, 2.0, 1)).hears(55 * MS, Setpoint(2.0, 2.0, Mode.STOP, 2)).until(2000 * MS)

    assert [kind for _, kind, _ in drive.events] == ["drive running", "drive stopped"]
    assert drive.wheels() == (0.0, 0.0)
    assert drive.said(WheelSpeeds)[-1][1].state == DriveState.STOPPED


def test_a_drive_that_never_heard_anything_stands_and_says_so(bench: Bench) -> None:
    drive = bench({"tau_wheel_s": 0.1}).until(500 * MS)

    assert {message for _, message in drive.said(Status)} == {Status(DriveState.STOPPED, 0, 0, NO_AGE_MS)}
    assert {message for _, message in drive.said(Odometry)} == {Odometry(0, 0)}
    assert drive.wheels() == (0.0, 0.0)


def test_the_counter_in_force_is_confirmed_with_the_outputs(bench: Bench) -> None:
    drive = bench({}).hears(5 * MS, run(1.0, 1.0, 41)).hears(12 * MS, run(2.0, 2.0, 42), run(3.0, 3.0, 43))
    drive.until(50 * MS)

    assert [(message.state, message.counter) for _, message in drive.said(WheelSpeeds)] == [
        (0, 0), (1, 41), (1, 43), (1, 43), (1, 43)]


def test_the_status_tells_age_and_refusals(bench: Bench) -> None:
    bad = pack(CanFrame(0x110, b"\xff" * 8))
    drive = bench({}, status_every=1).hears(5 * MS, run(1.0, 1.0, 9)).hears(6 * MS, bad, bad).until(45 * MS)

    assert [message for _, message in drive.said(Status)] == [
        Status(0, 0, 0, NO_AGE_MS), Status(1, 9, 2, 5), Status(1, 9, 2, 15), Status(1, 9, 2, 25), Status(1, 9, 2, 35)]


# --- whatever comes over the wire


@pytest.mark.parametrize(("frame", "detail"), [
    (CanFrame(0x110, bytes(7)), "DriveSetpoint: 7 bytes, expected 8"),
    (CanFrame(0x110, struct.pack("<q", 6_000_000)), "DriveSetpoint: left_radps=600: expected at most 500"),
    (CanFrame(0x110, bytes(6) + b"\x07\x00"), "DriveSetpoint: mode=7: expected one of 0 STOP, 1 RUN"),
    (CanFrame(0x110, remote=True, dlc=8), "DriveSetpoint: a remote frame"),
])
def test_a_frame_that_is_no_setpoint_is_counted_named_and_ignored(frame: CanFrame, detail: str, bench: Bench) -> None:
    drive = bench({}, stale_after_ns=100 * MS, **OPEN_LOOP)
    drive.hears(5 * MS, run(2.0, 1.0)).hears(25 * MS, pack(frame)).until(60 * MS)

    assert drive.events == [(10 * MS, "drive running", ""), (25 * MS, "setpoint refused", detail)]
    assert (drive.counters["setpoints taken"], drive.counters["setpoints refused"]) == (1, 1)
    assert drive.wheels() == (2.0, 1.0)
    drive.hears(70 * MS, pack(frame)).until(120 * MS)
    assert [kind for _, kind, _ in drive.events][-1] == "setpoint stale"        # a refused one keeps nothing alive


def test_frames_of_others_and_messages_of_the_controller_leave_no_trace(bench: Bench) -> None:
    others = [CanFrame(0x111, bytes(8)), CanFrame(0x110, bytes(8), extended=True), CanFrame(0x190, bytes(3)),
              CanFrame(0x4, bytes(8), error=True), CanFrame(0x110, bytes(8), error=True)]
    drive = bench({}).hears(5 * MS, *map(pack, others)).until(50 * MS)

    assert (drive.events, any(drive.counters.values())) == ([], False)


def anything() -> st.SearchStrategy[bytes]:
    """Noise; structs that claim to be setpoints; setpoints with any payload."""
    return st.one_of(
        st.binary(max_size=80),
        st.builds(lambda length, rest: struct.pack("<IB", 0x110, length) + rest, st.integers(0, 255),
                  st.sampled_from([11, 67]).flatmap(lambda size: st.binary(min_size=size, max_size=size))),
        st.builds(lambda body: struct.pack("<IBxxx", 0x110, 8) + body, st.binary(min_size=8, max_size=8)))


def counted_as(data: bytes) -> str:
    try:
        frame = unpack(data)
    except MalformedFrame:
        return "unreadable"
    return "setpoint" if frame.can_id == 0x110 and not frame.extended and not frame.error else "foreign"


@settings(max_examples=examples(60), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(frames=st.lists(anything(), max_size=30))
def test_every_frame_is_counted_once_whatever_its_bytes(frames: list[bytes], bench: Bench) -> None:
    drive = bench({}).hears(5 * MS, *frames).until(30 * MS)

    kinds, counters = [counted_as(data) for data in frames], drive.counters
    assert counters.get("unreadable frames", 0) == kinds.count("unreadable")
    assert counters.get("setpoints taken", 0) + counters.get("setpoints refused", 0) == kinds.count("setpoint")
    assert [kind for _, kind, _ in drive.events].count("setpoint refused") == counters.get("setpoints refused", 0)


# --- what cannot start


@pytest.mark.parametrize(("wrong", "says"), [
    ({"period_ns": 0}, "period_ns=0: expected at least 1"),
    ({"offset_ns": 10 * MS}, "offset_ns=10000000: expected 0 <= offset < period"),
    ({"execution_ns": 10 * MS}, "execution_ns=10000000: expected 0 <= execution < period"),
    ({"stale_after_ns": 1}, "stale_after_ns=1: expected at least one period of the loop"),
    ({"stop_ramp_radps2": 0.0}, "stop_ramp_radps2=0.0: expected more than 0"),
    ({"ramp_radps2": -1.0}, "ramp_radps2=-1.0: expected 0 or more"),
    ({"kp": -1.0}, "kp=-1.0: expected 0 or more"),
    ({"ki": math.nan}, "ki=nan: expected 0 or more"),
    ({"counts_per_turn": 0}, "counts_per_turn=0: expected at least 1"),
    ({"unit": 16}, "unit=16: expected 0 to 15"),
    ({"port": "can7"}, "port='can7': no such port; there are can; name the CAN bus"),
])
def test_settings_that_make_no_sense_are_refused(wrong: dict[str, float], says: str, bench: Bench) -> None:
    with pytest.raises(ValueError) as caught:
        bench({}, **wrong)

    assert says in str(caught.value)


def test_a_drive_without_wheels_is_refused() -> None:
    node = Node("lonely", ["can"])
    board = Board(node, LocalClock(ClockSettings(), node.env.time_ns), None, {}, Random(1), {})

    with pytest.raises(NoPlant, match=r"lonely has no plant; give it one, as agents.lonely.plant = "):
        DriveController(board, DriveSettings())


def test_the_check_names_every_drive_that_cannot_start_and_two_of_one_unit(tmp_path) -> None:
    (tmp_path / "own.dbc").write_text("BO_ ?")

    def drive(name: str, media: tuple[str, ...] = ("can",), plant: object = "unicycle",
              **parameters: object) -> OwnAgent[DriveSettings]:
        return OwnAgent(name, DriveSettings(**parameters), SimpleNamespace(media=media, plant=plant))

    drives = (drive("left"), drive("right"), drive("third", unit=1), drive("other", ("can2",), port="can2"),
              drive("bare", plant=None, unit=2), drive("torn", dbc=tmp_path / "own.dbc"),
              drive("lost", ("radio", "bus")))

    lines = list(DriveController.check(SimpleNamespace(), {each.name: each for each in drives}))

    assert lines == [
        "agents.right.parameters: unit=0: left has the identifier 0x110 on can too, and their frames would collide; "
        "give each drive its own unit",
        'agents.bare: a drive controller needs a plant, as plant = { fmu = "unicycle" }',
        f"agents.torn.parameters: {tmp_path / 'own.dbc'}: line 1, column 5: not DBC: BO_ <here> ?; correct it there",
        "agents.lost.parameters: port='can': no such port; there are radio, bus; name the CAN bus that the drive is on",
    ]
