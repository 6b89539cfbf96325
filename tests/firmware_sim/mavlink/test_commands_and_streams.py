"""The command protocol and the streams, with pymavlink as the ground and the stand-in vehicle."""

from dataclasses import replace
from math import degrees, hypot, nan

import pytest
from pymavlink.dialects.v20 import common
from scipy.spatial.transform import Rotation

from firmware_sim.autopilot.vehicle import Mode
from firmware_sim.mavlink.geodesy import Origin
from firmware_sim.mavlink.px4_modes import MAIN_AND_SUB, custom_mode, mode_of_custom
from firmware_sim.mavlink.settings import MavlinkSettings
from firmware_sim.mavlink.streams import Streams
from firmware_sim.mavlink.telemetry import names
from tests.firmware_sim.mavlink.ground import TICK_NS, Ground, kinds

ACCEPTED, REJECTED, DENIED, UNSUPPORTED = (common.MAV_RESULT_ACCEPTED, common.MAV_RESULT_TEMPORARILY_REJECTED,
                                           common.MAV_RESULT_DENIED, common.MAV_RESULT_UNSUPPORTED)
ARM = common.MAV_CMD_COMPONENT_ARM_DISARM
TAKEOFF = common.MAV_CMD_NAV_TAKEOFF


def test_arm_take_off_land_and_the_states_on_the_way():
    ground = Ground()
    states = []

    def state():
        _, (told,) = ground.command(common.MAV_CMD_REQUEST_MESSAGE, common.MAVLINK_MSG_ID_EXTENDED_SYS_STATE)
        states.append(told.landed_state)

    state()
    assert ground.command(ARM, 1)[0] == ACCEPTED
    assert ground.command(TAKEOFF, nan, 0, 0, nan, nan, nan, 490.0)[0] == ACCEPTED
    state()
    ground.until(lambda: ground.vehicle.mode is Mode.HOLD)
    state()
    assert ground.vehicle.position == pytest.approx((0, 0, -2.0), abs=0.06)      # 490 m are 2 m above the origin's 488
    assert ground.command(common.MAV_CMD_NAV_LAND)[0] == ACCEPTED
    state()
    ground.until(lambda: not ground.vehicle.armed)
    state()

    assert states == [common.MAV_LANDED_STATE_ON_GROUND, common.MAV_LANDED_STATE_TAKEOFF,
                      common.MAV_LANDED_STATE_IN_AIR, common.MAV_LANDED_STATE_LANDING,
                      common.MAV_LANDED_STATE_ON_GROUND]


@pytest.mark.parametrize(("number", "parameters", "result", "calls"), [
    (ARM, (1,), ACCEPTED, ["arm False"]), (ARM, (1, 21196), ACCEPTED, ["arm True"]),
    (ARM, (0,), ACCEPTED, ["disarm False"]), (ARM, (2,), DENIED, []), (ARM, (nan,), DENIED, []),
    (TAKEOFF, (0, 0, 0, 0, 0, 0, 489.0), REJECTED, ["take off 1"]), (TAKEOFF, (nan,) * 7, REJECTED, ["take off 1.5"]),
    (common.MAV_CMD_DO_SET_MODE, (1, 7, 0), ACCEPTED, ["mode stabilize"]),
    (common.MAV_CMD_DO_SET_MODE, (1, 6, 0), REJECTED, ["mode offboard"]),
    (common.MAV_CMD_DO_SET_MODE, (1, 3, 0), UNSUPPORTED, []), (common.MAV_CMD_DO_SET_MODE, (0, 7, 0), DENIED, []),
    (common.MAV_CMD_DO_SET_MODE, (1, nan, 0), DENIED, []),
    (common.MAV_CMD_NAV_RETURN_TO_LAUNCH, (), ACCEPTED, ["mode return"]),
    (common.MAV_CMD_MISSION_START, (0, 0), DENIED, ["mission 0"]), (common.MAV_CMD_MISSION_START, (nan, 0), DENIED, []),
    (common.MAV_CMD_DO_DIGICAM_CONTROL, (), UNSUPPORTED, []), (65_535, (), UNSUPPORTED, []),
    (common.MAV_CMD_REQUEST_MESSAGE, (common.MAVLINK_MSG_ID_RAW_IMU,), UNSUPPORTED, []),
    (common.MAV_CMD_SET_MESSAGE_INTERVAL, (30, nan), DENIED, []),
    (common.MAV_CMD_SET_MESSAGE_INTERVAL, (30, 1e30), DENIED, []), (common.MAV_CMD_SET_MESSAGE_INTERVAL, (nan, 0),
                                                                   UNSUPPORTED, [])])
def test_each_command_is_carried_out_or_refused_and_answered_once(number, parameters, result, calls):
    ground = Ground()

    assert ground.command(number, *parameters)[0] == result
    assert ground.vehicle.calls == calls


def test_a_command_int_is_answered_too_and_its_frame_says_what_the_height_counts_from():
    ground = Ground()
    ground.command(ARM, 1)

    answers = ground.say(ground.mav.command_int_encode(1, 1, common.MAV_FRAME_GLOBAL_RELATIVE_ALT, TAKEOFF, 0, 0,
                                                       0, 0, 0, 0, 0, 0, 3.0))

    assert kinds(answers) == ["COMMAND_ACK"]
    assert ground.vehicle.calls[-1] == "take off 3"


def test_a_command_whose_answer_was_lost_is_answered_again_and_not_carried_out_twice():
    ground = Ground()

    results = [ground.command(ARM, 1, confirmation=number)[0] for number in (0, 1, 2)]
    other = ground.command(ARM, 0, confirmation=3)[0]

    assert results == [ACCEPTED] * 3
    assert other == ACCEPTED
    assert ground.vehicle.calls == ["arm False", "disarm False"]


def test_refusals_tell_the_reason_as_a_text():
    ground = Ground()
    ground.vehicle.position_valid = False

    result, told = ground.command(ARM, 1)

    assert result == REJECTED
    assert [(text.severity, text.text) for text in told] == [(common.MAV_SEVERITY_ERROR, "arming refused: no position")]


def test_what_is_asked_for_is_told():
    ground = Ground()
    ground.fly_up()

    (version,) = ground.command(common.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, 1)[1]
    (home,) = ground.command(common.MAV_CMD_GET_HOME_POSITION)[1]
    (where,) = ground.command(common.MAV_CMD_REQUEST_MESSAGE, common.MAVLINK_MSG_ID_GLOBAL_POSITION_INT)[1]

    assert version.capabilities & common.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    assert (home.latitude, home.longitude, home.altitude) == (473_977_420, 85_455_940, 488_000)
    assert where.alt == pytest.approx(490_000, abs=60)
    assert where.relative_alt == pytest.approx(2_000, abs=60)


def test_every_message_that_can_be_streamed_can_be_asked_for():
    ground = Ground()

    told = [ground.command(common.MAV_CMD_REQUEST_MESSAGE, number)[1] for number in names()]

    assert [kinds(messages) for messages in told] == [[name] for name in names().values()]


def test_home_is_told_when_it_moves():
    ground = Ground()
    ground.vehicle.position = ground.vehicle.goal = (3.0, 4.0, 0.0)

    _, told = ground.command(ARM, 1)

    (home,) = [message for message in told if message.get_type() == "HOME_POSITION"]
    assert (home.x, home.y, home.z) == (3.0, 4.0, 0.0)


@pytest.mark.parametrize("mode", list(Mode))
def test_modes_are_px4s(mode):
    main, sub = MAIN_AND_SUB[mode]
    from pymavlink.mavutil import interpret_px4_mode

    names = {Mode.STABILIZE: "STABILIZED", Mode.HOLD: "LOITER", Mode.OFFBOARD: "OFFBOARD", Mode.TAKEOFF: "TAKEOFF",
             Mode.LAND: "LAND", Mode.MISSION: "MISSION", Mode.RETURN: "RTL"}
    assert interpret_px4_mode(0, custom_mode(mode)) == names[mode]
    assert mode_of_custom(custom_mode(mode)) is mode
    assert custom_mode(mode) == (main << 16) + (sub << 24)


def test_the_heartbeat_says_mode_arming_and_failsafe():
    ground = Ground(quiet=False)
    ground.run(2.0)
    ground.vehicle.failsafe = "link lost: hold"
    ground.command(ARM, 1)
    ground.run(1.5)

    beats = [message for _, message in ground.heard if message.get_type() == "HEARTBEAT"]

    assert {(beat.type, beat.autopilot) for beat in beats} == {(common.MAV_TYPE_QUADROTOR, common.MAV_AUTOPILOT_PX4)}
    assert [(bool(beat.base_mode & 128), beat.system_status) for beat in (beats[0], beats[-1])] == [
        (False, common.MAV_STATE_STANDBY), (True, common.MAV_STATE_CRITICAL)]


# --- streams

def rate_hz(ground, name, seconds=10.0):
    return kinds(ground.run(seconds)).count(name) / seconds


def test_streams_have_their_default_rates_and_take_new_ones():
    ground = Ground(quiet=False)
    interval = common.MAV_CMD_SET_MESSAGE_INTERVAL
    before = rate_hz(ground, "ATTITUDE")

    assert ground.command(interval, common.MAVLINK_MSG_ID_ATTITUDE, 100_000)[0] == ACCEPTED
    faster = rate_hz(ground, "ATTITUDE")
    ground.command(interval, common.MAVLINK_MSG_ID_ATTITUDE, -1)
    off = rate_hz(ground, "ATTITUDE")
    _, (told,) = ground.command(common.MAV_CMD_GET_MESSAGE_INTERVAL, common.MAVLINK_MSG_ID_ATTITUDE)
    ground.command(interval, common.MAVLINK_MSG_ID_ATTITUDE, 0)
    again = rate_hz(ground, "ATTITUDE")
    ground.command(interval, common.MAVLINK_MSG_ID_ATTITUDE, 1)

    assert (before, faster, off, again) == pytest.approx((5.0, 10.0, 0.0, 5.0), abs=0.1)     # one in 10 s at the edges
    assert told.interval_us == -1
    assert rate_hz(ground, "ATTITUDE") == pytest.approx(1e9 / TICK_NS, abs=0.1)             # no faster than its task


def test_a_stream_does_not_drift():
    ground = Ground(streams_hz={"HEARTBEAT": 3.0}, quiet=False)
    ground.run(60.0)

    times = [at_ns for at_ns, message in ground.heard if message.get_type() == "HEARTBEAT"]

    assert all(0 <= at_ns - k * 333_333_333 <= TICK_NS for k, at_ns in enumerate(times))


@pytest.mark.parametrize("budget", [0, 2_000])
def test_streams_go_on_after_the_clock_was_set_back(budget):
    ground = Ground(quiet=False, budget_bytes_per_s=budget)
    ground.run(100.0)
    ground.now_ns = ground.vehicle.now_ns = 5_000_000_000

    assert kinds(ground.run(10.0)).count("HEARTBEAT") == pytest.approx(10, abs=1)
    assert kinds(ground.run(10.0)).count("LOCAL_POSITION_NED") >= 50


def test_a_budget_slows_all_streams_down_and_starves_none():
    ground = Ground(quiet=False, budget_bytes_per_s=600)
    ground.run(20.0)

    heard = [message for _, message in ground.heard]
    sent = sum(len(message.get_msgbuf()) for message in heard)

    assert sent <= 600 * 20 + 300 + 300             # what was saved up, and the one that overdrew last
    assert sent >= 0.95 * 600 * 20
    for name in MavlinkSettings().intervals_ns("telemetry"):
        assert kinds(heard).count(name) >= 5, name
    assert 19 <= kinds(heard).count("HEARTBEAT") <= 21          # never held back


def test_who_has_waited_longest_goes_first():
    streams, sent = Streams(dict.fromkeys("abc", TICK_NS)), []
    for tick in range(99):                      # room for one at each
        name = streams.due(tick * TICK_NS)[0]
        streams.done(name, tick * TICK_NS)
        sent.append(name)

    assert {name: sent.count(name) for name in "abc"} == {"a": 33, "b": 33, "c": 33}


def test_each_field_of_the_telemetry_has_its_own_value():
    ground = Ground()
    x, y, z, w = Rotation.from_euler("ZYX", [0.5, 0.25, 0.125]).as_quat()
    state = replace(ground.vehicle.state(), time_ns=7_654_321_000, position_ned_m=(1.0, 2.0, -3.0),
                    velocity_ned_mps=(0.5, -0.25, -0.125), quaternion_wxyz=(w, x, y, z), rates_radps=(0.1, 0.2, 0.3))
    ground.vehicle.state = lambda: state

    def told(name):
        (found,) = ground.command(common.MAV_CMD_REQUEST_MESSAGE, getattr(common, f"MAVLINK_MSG_ID_{name}"))[1]
        return [getattr(found, field) for field in found.get_fieldnames()]

    assert told("ATTITUDE") == [7654, *(pytest.approx(value) for value in (0.125, 0.25, 0.5, 0.1, 0.2, 0.3))]
    assert told("ATTITUDE_QUATERNION")[:5] == [7654, *[pytest.approx(value) for value in (w, x, y, z)]]
    assert told("LOCAL_POSITION_NED") == [7654, 1.0, 2.0, -3.0, 0.5, -0.25, -0.125]
    latitude_e7, longitude_e7 = Origin().to_global(1.0, 2.0)
    assert told("GLOBAL_POSITION_INT") == [7654, latitude_e7, longitude_e7, 491_000, 3_000, 50, -25, -12,
                                           round(degrees(0.5) * 100)]
    hud = told("VFR_HUD")
    assert hud == [pytest.approx(hypot(0.5, 0.25)), pytest.approx(hypot(0.5, 0.25)), 29, 0, 491.0, 0.125]


def test_without_a_position_none_is_told_and_the_sensors_say_so():
    ground = Ground()
    ground.vehicle.position_valid = False

    results = [ground.command(common.MAV_CMD_REQUEST_MESSAGE, number)[0] for number in
               (common.MAVLINK_MSG_ID_LOCAL_POSITION_NED, common.MAVLINK_MSG_ID_GLOBAL_POSITION_INT)]
    (status,) = ground.command(common.MAV_CMD_REQUEST_MESSAGE, common.MAVLINK_MSG_ID_SYS_STATUS)[1]
    (gps,) = ground.command(common.MAV_CMD_REQUEST_MESSAGE, common.MAVLINK_MSG_ID_GPS_RAW_INT)[1]

    assert results == [REJECTED, REJECTED]
    assert not status.onboard_control_sensors_health & common.MAV_SYS_STATUS_SENSOR_GPS
    assert status.onboard_control_sensors_present & common.MAV_SYS_STATUS_SENSOR_GPS
    assert status.onboard_control_sensors_health & common.MAV_SYS_STATUS_GEOFENCE      # FENCE_XY clips all the same
    assert gps.fix_type == common.GPS_FIX_TYPE_NO_FIX


def test_a_parameter_list_gets_its_turn_within_the_budget():
    ground = Ground(quiet=False, budget_bytes_per_s=600)
    ground.run(2.0)
    ground.say(ground.mav.param_request_list_encode(1, 1))

    told = kinds(ground.run(2.0))

    assert told.count("PARAM_VALUE") == 3
    assert len(told) > 10


def test_the_failsafe_is_fed_by_ground_stations_and_by_who_speaks_to_us_only():
    ground = Ground()
    mav = ground.mav

    def fed(message):
        before = len(ground.vehicle.heard_ns)
        ground.say(message)
        return len(ground.vehicle.heard_ns) - before

    assert fed(mav.heartbeat_encode(common.MAV_TYPE_GCS, 8, 0, 0, 4)) == 1
    assert fed(mav.heartbeat_encode(common.MAV_TYPE_ONBOARD_CONTROLLER, 8, 0, 0, 4)) == 1
    assert fed(mav.ping_encode(0, 0, 1, 1)) == 1
    assert fed(mav.heartbeat_encode(common.MAV_TYPE_QUADROTOR, 12, 0, 0, 4)) == 0
    assert fed(mav.attitude_encode(0, 0, 0, 0, 0, 0, 0)) == 0
    assert fed(mav.ping_encode(0, 0, 9, 1)) == 0


def test_clocks_and_pings_are_answered():
    ground = Ground()

    (sync,) = ground.say(ground.mav.timesync_encode(0, 123))
    (ping,) = ground.say(ground.mav.ping_encode(77, 3, 0, 0))

    assert (sync.tc1, sync.ts1) == (TICK_NS, 123)
    assert (ping.time_usec, ping.seq, ping.target_system, ping.target_component) == (77, 3, 255, 190)
    assert ground.say(ground.mav.timesync_encode(5, 123)) == []


def test_losses_on_the_way_up_are_told_in_sys_status():
    ground = Ground()
    for number in (0, 1, 5):
        ground.mav.seq = number
        ground.say(ground.mav.ping_encode(0, number, 1, 1))
    ground.mav.seq = 6

    (status,) = ground.command(common.MAV_CMD_REQUEST_MESSAGE, common.MAVLINK_MSG_ID_SYS_STATUS)[1]

    assert status.errors_comm == 3
    assert ground.front.counts["frames lost from 255/190"] == 3


@pytest.mark.parametrize(("settings", "says"), [
    ({"period_ns": 0}, "period_ns=0"), ({"execution_ns": 5_000_000}, "execution_ns=5000000"),
    ({"system": 0}, "system=0: expected 1 to 255"), ({"streams_hz": {"RAW_IMU": 1.0}}, "no such stream"),
    ({"streams_hz": {"ATTITUDE": 1000.0}}, "expected 0 to 200"), ({"signing_key": "12"}, "64 hexadecimal digits"),
    ({"latitude_deg": 91.0}, "latitude_deg=91"), ({"budget_bytes_per_s": -1}, "budget_bytes_per_s=-1")])
def test_nonsense_settings_are_refused(settings, says):
    with pytest.raises(ValueError, match=says):
        MavlinkSettings(**settings)
