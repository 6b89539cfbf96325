"""Setpoints, the parameter protocol and the mission protocol, with pymavlink as the ground and the stand-in vehicle."""

from math import cos, hypot, inf, isnan, nan, pi, sin

import pytest
from pymavlink.dialects.v20 import common

from firmware_sim.autopilot.vehicle import MOST_MISSION_ITEMS, AttitudeTarget, ItemKind, Mode, PositionTarget
from firmware_sim.mavlink.geodesy import Origin
from tests.firmware_sim.mavlink.ground import Ground, kinds

ONLY_POSITION = 0b1101_1111_1000
ONLY_VELOCITY = 0b1101_1100_0111
YAW = 0b0100_0000_0000
LOCAL, OFFSET, BODY = common.MAV_FRAME_LOCAL_NED, common.MAV_FRAME_LOCAL_OFFSET_NED, common.MAV_FRAME_BODY_NED


def position_target(ground, mask, *values, frame=LOCAL):
    padded = (*values, *(0.0,) * (11 - len(values)))
    return ground.say(ground.mav.set_position_target_local_ned_encode(0, 1, 1, frame, mask, *padded))


def attitude_target(ground, mask, q=(1.0, 0.0, 0.0, 0.0), rates=(0.0, 0.0, 0.0), thrust=0.5):
    return ground.say(ground.mav.set_attitude_target_encode(0, 1, 1, mask, q, *rates, thrust))


@pytest.mark.parametrize(("mask", "values", "target"), [
    (ONLY_POSITION, (1.0, 2.0, -3.0), PositionTarget((1.0, 2.0, -3.0))),
    (ONLY_POSITION & ~YAW, (1.0, 2.0, -3.0, *(0.0,) * 6, 0.5), PositionTarget((1.0, 2.0, -3.0), yaw_rad=0.5)),
    (ONLY_VELOCITY, (0.0, 0.0, 0.0, 0.5, 0.25, -1.0), PositionTarget(velocity_ned_mps=(0.5, 0.25, -1.0))),
    (ONLY_VELOCITY & ~0x800, (*(0.0,) * 5, -1.0, *(0.0,) * 4, 0.25),
     PositionTarget(velocity_ned_mps=(0.0, 0.0, -1.0), yaw_rate_radps=0.25)),
    (ONLY_POSITION & ONLY_VELOCITY, (1.0, 2.0, -3.0, 0.5, 0.0, 0.0), PositionTarget((1.0, 2.0, -3.0), (0.5, 0.0, 0.0))),
    (ONLY_POSITION | 0b011, (7.0, 7.0, -2.0), PositionTarget((None, None, -2.0)))])
def test_a_position_target_has_the_axes_that_its_mask_leaves(mask, values, target):
    ground = Ground()

    assert position_target(ground, mask, *values) == []
    assert ground.vehicle.targets == [target]


def test_targets_from_where_it_is_and_in_the_direction_of_its_nose():
    ground = Ground()
    ground.vehicle.position = ground.vehicle.goal = (10.0, 20.0, -5.0)
    ground.vehicle.yaw = 0.5

    position_target(ground, ONLY_POSITION, 1.0, 2.0, -1.0, frame=OFFSET)
    position_target(ground, ONLY_VELOCITY, 0.0, 0.0, 0.0, 2.0, 1.0, -1.0, frame=BODY)

    offset, body = ground.vehicle.targets
    assert offset == PositionTarget((11.0, 22.0, -6.0))
    assert body.velocity_ned_mps == pytest.approx((2 * cos(0.5) - sin(0.5), 2 * sin(0.5) + cos(0.5), -1.0), abs=1e-6)


@pytest.mark.parametrize(("mask", "values", "frame"), [
    (ONLY_POSITION, (nan, 0.0, 0.0), LOCAL), (ONLY_POSITION, (inf, 0.0, 0.0), LOCAL), (0xFFF & ~512, (), LOCAL),
    (ONLY_POSITION & ~64, (), LOCAL), (ONLY_POSITION | 512, (), LOCAL), (ONLY_POSITION, (), common.MAV_FRAME_GLOBAL),
    (ONLY_POSITION | 0b001, (), BODY), (ONLY_POSITION & ~YAW, (*(0.0,) * 9, nan), LOCAL)])
def test_targets_that_mean_nothing_are_refused_counted_and_told_once_a_second(mask, values, frame):
    ground = Ground()

    told = position_target(ground, mask, *values, frame=frame) + position_target(ground, mask, *values, frame=frame)

    assert ground.vehicle.targets == []
    assert ground.front.counts["setpoints refused"] == 2
    assert kinds(told) == ["STATUSTEXT"]


def test_what_the_vehicle_clips_is_counted_and_told():
    ground = Ground()
    ground.fly_up()
    position_target(ground, ONLY_POSITION, 0.0, 0.0, -2.0)
    ground.command(common.MAV_CMD_DO_SET_MODE, 1, 6)

    (text,) = position_target(ground, ONLY_POSITION, 500.0, 0.0, -2.0)

    assert text.text == "position clipped"
    assert ground.front.counts["setpoints clipped or refused"] == 1


def test_attitude_targets_attitude_with_rates_beside_it_or_rates_alone():
    ground = Ground()
    half = (cos(0.1), sin(0.1), 0.0, 0.0)

    attitude_target(ground, 0b111, tuple(2 * value for value in half))
    attitude_target(ground, 0, half, (0.5, 0.25, 0.0))
    attitude_target(ground, 128, (0.0,) * 4, (0.5, 0.25, 0.0), 0.75)
    first, second, third = ground.vehicle.targets

    assert first.quaternion_wxyz == pytest.approx(half, abs=1e-7)
    assert (first.rates_radps, first.thrust) == (None, 0.5)
    assert second.rates_radps == (0.5, 0.25, 0.0)
    assert third == AttitudeTarget(None, (0.5, 0.25, 0.0), 0.75)


@pytest.mark.parametrize(("mask", "q", "rates", "thrust"), [
    (0b111, (0.0,) * 4, (0.0,) * 3, 0.5), (0b111, (nan, 0.0, 0.0, 0.0), (0.0,) * 3, 0.5),
    (0b111 | 64, (1.0, 0.0, 0.0, 0.0), (0.0,) * 3, 0.5), (0b111, (1.0, 0.0, 0.0, 0.0), (0.0,) * 3, nan),
    (128 | 1, (0.0,) * 4, (0.0,) * 3, 0.5), (128, (0.0,) * 4, (nan, 0.0, 0.0), 0.5)])
def test_attitude_targets_that_mean_nothing_are_refused(mask, q, rates, thrust):
    ground = Ground()

    told = attitude_target(ground, mask, q, rates, thrust)

    assert ground.vehicle.targets == []
    assert kinds(told) == ["STATUSTEXT"]


# --- parameters

def test_all_parameters_are_listed_with_their_places():
    ground = Ground()
    ground.say(ground.mav.param_request_list_encode(1, 1))

    ground.run(1.0)
    told = [message for _, message in ground.heard]

    assert [(value.param_id, value.param_index, value.param_count, value.param_type) for value in told] == [
        (name, index, 3, 9) for index, name in enumerate(ground.vehicle.parameters.infos)]


def test_a_parameter_is_read_by_name_and_by_place_and_written():
    ground, mav = Ground(), Ground().mav

    (by_name,) = ground.say(mav.param_request_read_encode(1, 1, b"NAV_ACC_RAD", -1))
    (by_place,) = ground.say(mav.param_request_read_encode(1, 1, b"", 1))
    (written,) = ground.say(mav.param_set_encode(1, 1, b"NAV_ACC_RAD", 0.5, 9))

    assert by_name.param_value == by_place.param_value == pytest.approx(0.3)
    assert written.param_value == ground.vehicle.parameters.get("NAV_ACC_RAD") == 0.5


@pytest.mark.parametrize(("name", "value", "kind", "text"), [
    (b"NAV_ACC_RAD", 99.0, 9, "not set: NAV_ACC_RAD=99: expected 0.05 to 5"),
    (b"NAV_ACC_RAD", nan, 9, "not set: NAV_ACC_RAD=nan: is no number"),
    (b"NAV_ACC_RAD", 1.0, 6, "not set: NAV_ACC_RAD: type 6, not REAL32")])
def test_a_value_that_is_refused_is_answered_with_the_one_that_holds_and_the_reason(name, value, kind, text):
    ground = Ground()

    told, why = ground.say(ground.mav.param_set_encode(1, 1, name, value, kind))

    assert told.param_value == pytest.approx(0.3)
    assert why.text == text
    assert ground.vehicle.parameters.get("NAV_ACC_RAD") == 0.3


@pytest.mark.parametrize("name", [b"NO_SUCH", b"\xff\xfe", b""])
def test_a_parameter_that_is_not_there_changes_nothing(name):
    ground = Ground()

    told = ground.say(ground.mav.param_set_encode(1, 1, name, 1.0, 9),
                      ground.mav.param_request_read_encode(1, 1, b"", 77))

    assert kinds(told) == ["STATUSTEXT"]


# --- missions

RELATIVE = common.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT

ITEMS = [(common.MAV_CMD_NAV_TAKEOFF, 0.0, 0.0, 2.0), (common.MAV_CMD_NAV_WAYPOINT, 4.0, 0.0, 2.0),
         (common.MAV_CMD_NAV_WAYPOINT, 4.0, 3.0, 3.0), (common.MAV_CMD_NAV_LAND, 0.0, 0.0, 0.0)]


def item(ground, number, command, north_m, east_m, height_m, frame=RELATIVE, hold_s=0.0):
    latitude_e7, longitude_e7 = Origin().to_global(north_m, east_m)
    return ground.mav.mission_item_int_encode(1, 1, number, frame, command, 0, 1, hold_s, 0.0, 0.0, nan, latitude_e7,
                                              longitude_e7, height_m)


def upload(ground, items=ITEMS, lose=()):
    """As a ground station does: gives what it is asked for, but not the requests whose numbers are in `lose`."""
    asked = []
    answers = ground.say(ground.mav.mission_count_encode(1, 1, len(items)))
    for _ in range(2_000):
        for answer in answers:
            if answer.get_type() == "MISSION_ACK":
                return answer.type, asked
            if answer.get_type() == "MISSION_REQUEST_INT":
                asked.append(answer.seq)
                if len(asked) - 1 not in lose:
                    answers = ground.say(item(ground, answer.seq, *items[answer.seq]))
                    break
        else:
            answers = ground.tick()
            continue
        if len(asked) - 1 in lose:
            answers = ground.tick()
    raise AssertionError("no end")


def download(ground):
    (count,) = ground.say(ground.mav.mission_request_list_encode(1, 1))
    return [ground.say(ground.mav.mission_request_int_encode(1, 1, number))[0] for number in range(count.count)]


def test_a_mission_is_uploaded_and_comes_back_with_the_same_numbers():
    ground = Ground()

    assert upload(ground) == (common.MAV_MISSION_ACCEPTED, [0, 1, 2, 3])
    back = download(ground)
    again = Ground()
    again.say(again.mav.mission_count_encode(1, 1, 4))
    for told in back:
        told.target_system = told.target_component = 1
        again.say(told)

    assert [(told.command, told.x, told.y, told.z) for told in back] == [
        (command, *Origin().to_global(north, east), height) for command, north, east, height in ITEMS]
    assert all(isnan(told.param4) for told in back)
    assert again.vehicle.mission == ground.vehicle.mission
    assert [found.kind for found in ground.vehicle.mission] == [ItemKind.TAKEOFF, ItemKind.WAYPOINT, ItemKind.WAYPOINT,
                                                               ItemKind.LAND]
    # an item's place is whole 1e-7 degrees: 0.56 cm of latitude either way
    assert ground.vehicle.mission[2].position_ned_m == pytest.approx((4.0, 3.0, -3.0), abs=0.006)


def test_items_that_are_lost_are_asked_for_again():
    ground = Ground()

    result, asked = upload(ground, lose=(1, 2, 5))

    assert result == common.MAV_MISSION_ACCEPTED
    assert asked == [0, 1, 1, 1, 2, 3, 3]
    assert len(ground.vehicle.mission) == 4


def test_an_upload_that_stops_is_given_up_and_changes_nothing():
    ground = Ground()
    upload(ground)
    before = ground.vehicle.mission
    ground.say(ground.mav.mission_count_encode(1, 1, 3))

    told = ground.run(10.0)

    assert kinds(told) == ["MISSION_REQUEST_INT"] * 9 + ["MISSION_ACK"]
    assert told[-1].type == common.MAV_MISSION_OPERATION_CANCELLED
    assert ground.vehicle.mission == before


def test_the_last_item_again_is_answered_again():
    ground = Ground()
    upload(ground)

    (ack,) = ground.say(item(ground, 3, *ITEMS[3]))

    assert ack.type == common.MAV_MISSION_ACCEPTED
    assert ground.vehicle.calls == ["load 4"]


def test_an_item_that_comes_twice_is_taken_once():
    ground = Ground()
    ground.say(ground.mav.mission_count_encode(1, 1, 4))

    for number in (0, 1, 0, 1, 2, 3):
        ground.say(item(ground, number, *ITEMS[number]))

    assert [round(found.position_ned_m[2], 6) for found in ground.vehicle.mission] == [-2.0, -2.0, -3.0, 0.0]


def test_heights_count_from_where_it_was_armed():
    ground = Ground()
    ground.vehicle.position = ground.vehicle.goal = (0.0, 0.0, -1.0)        # on a table
    ground.command(common.MAV_CMD_COMPONENT_ARM_DISARM, 1)

    upload(ground)
    (where,) = ground.command(common.MAV_CMD_REQUEST_MESSAGE, common.MAVLINK_MSG_ID_GLOBAL_POSITION_INT)[1]
    ground.command(common.MAV_CMD_NAV_TAKEOFF, *[nan] * 6, 491.0)

    assert ground.vehicle.mission[0].position_ned_m[2] == pytest.approx(-3.0)
    assert (where.alt, where.relative_alt) == (489_000, 0)
    assert ground.vehicle.calls[-1] == "take off 2"
    assert [told.z for told in download(ground)] == pytest.approx([height for _, _, _, height in ITEMS])


@pytest.mark.parametrize(("bad", "result"), [
    ((common.MAV_CMD_DO_JUMP, 0.0, 0.0, 0.0), common.MAV_MISSION_UNSUPPORTED),
    ((common.MAV_CMD_NAV_WAYPOINT, 0.0, 0.0, nan), common.MAV_MISSION_INVALID),
    ((common.MAV_CMD_NAV_WAYPOINT, 0.0, 0.0, 1e38), common.MAV_MISSION_INVALID),
    ((common.MAV_CMD_NAV_WAYPOINT, 0.0, 0.0, 1.0, common.MAV_FRAME_BODY_NED), common.MAV_MISSION_UNSUPPORTED_FRAME),
    ((common.MAV_CMD_NAV_WAYPOINT, 0.0, 0.0, 1.0, common.MAV_FRAME_GLOBAL, -1.0), common.MAV_MISSION_INVALID)])
def test_a_bad_item_ends_the_upload_with_its_reason(bad, result):
    ground = Ground()

    assert upload(ground, [ITEMS[0], bad])[0] == result
    assert ground.vehicle.mission == ()


def test_too_many_items_other_partners_and_fences_are_refused():
    ground, other = Ground(), Ground(system=254)
    mav = ground.mav

    (many,) = ground.say(mav.mission_count_encode(1, 1, MOST_MISSION_ITEMS + 1))
    (fence,) = ground.say(mav.mission_count_encode(1, 1, 3, common.MAV_MISSION_TYPE_FENCE))
    ground.say(mav.mission_count_encode(1, 1, 3))
    (busy,) = ground.tick(other.pack(other.mav.mission_count_encode(1, 1, 3)))
    (beyond,) = ground.say(mav.mission_request_int_encode(1, 1, 7))

    assert [ack.type for ack in (many, fence, busy, beyond)] == [
        common.MAV_MISSION_NO_SPACE, common.MAV_MISSION_UNSUPPORTED, common.MAV_MISSION_DENIED,
        common.MAV_MISSION_INVALID_SEQUENCE]
    assert fence.mission_type == common.MAV_MISSION_TYPE_FENCE
    assert busy.target_system == 254


def test_a_mission_is_flown_told_and_cleared():
    ground = Ground()
    upload(ground)
    ground.command(common.MAV_CMD_COMPONENT_ARM_DISARM, 1)

    assert ground.command(common.MAV_CMD_MISSION_START)[0] == common.MAV_RESULT_ACCEPTED
    ground.until(lambda: ground.vehicle.mode is Mode.HOLD)
    ground.run(0.1)
    reached = [message.seq for _, message in ground.heard if message.get_type() == "MISSION_ITEM_REACHED"]
    (ack,) = ground.say(ground.mav.mission_clear_all_encode(1, 1))

    assert reached == [0, 1, 2, 3]
    assert hypot(*ground.vehicle.position[:2]) < 0.1
    assert (ack.type, ground.vehicle.mission) == (common.MAV_MISSION_ACCEPTED, ())


def choose_by_message(ground, number):
    (current,) = ground.say(ground.mav.mission_set_current_encode(1, 1, number))
    return current.seq


def choose_by_command(ground, number):
    assert ground.command(common.MAV_CMD_DO_SET_MISSION_CURRENT, number)[0] == common.MAV_RESULT_ACCEPTED
    (current,) = ground.command(common.MAV_CMD_REQUEST_MESSAGE, common.MAVLINK_MSG_ID_MISSION_CURRENT)[1]
    return current.seq


@pytest.mark.parametrize("choose", [choose_by_message, choose_by_command])
@pytest.mark.parametrize("start", [(common.MAV_CMD_MISSION_START,), (common.MAV_CMD_DO_SET_MODE, 1, 4, 4)])
def test_an_item_that_was_chosen_is_flown_from_the_next_start_and_at_once_during_a_mission(choose, start):
    ground = Ground()
    upload(ground)
    ground.command(common.MAV_CMD_COMPONENT_ARM_DISARM, 1)

    chosen = choose(ground, 2)
    before = list(ground.vehicle.calls)
    ground.command(*start)
    started = ground.vehicle.calls[-1]
    choose(ground, 1)

    assert chosen == 2
    assert not any(call.startswith("mission") for call in before)       # on the ground nothing starts by itself
    assert (started, ground.vehicle.calls[-1]) == ("mission 2", "mission 1")


def test_an_item_that_is_not_there_cannot_be_chosen():
    ground = Ground()
    upload(ground)

    assert ground.command(common.MAV_CMD_DO_SET_MISSION_CURRENT, 4)[0] == common.MAV_RESULT_DENIED
    assert choose_by_message(ground, 77) == 0


def test_items_of_other_frames_and_the_older_message():
    ground, mav = Ground(), Ground().mav
    ground.say(mav.mission_count_encode(1, 1, 3))

    answers = ground.say(mav.mission_item_int_encode(1, 1, 0, common.MAV_FRAME_GLOBAL, 16, 0, 1, 0, 0, 0, 90.0,
                                                     473_977_420, 85_455_940, 490.0))
    answers += ground.say(mav.mission_item_encode(1, 1, 1, common.MAV_FRAME_LOCAL_NED, 16, 0, 1, 1.5, 0.25, 0, nan, 1.0,
                                                  2.0, -3.0))
    answers += ground.say(mav.mission_item_int_encode(1, 1, 2, common.MAV_FRAME_MISSION, 20, 0, 1, 0, 0, 0, 0, 0, 0, 0))
    first, second, third = ground.vehicle.mission

    assert kinds(answers) == ["MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK"]
    assert first.position_ned_m == pytest.approx((0.0, 0.0, -2.0))
    assert first.yaw_rad == pytest.approx(pi / 2)
    assert (second.position_ned_m, second.hold_s, second.acceptance_m) == ((1.0, 2.0, -3.0), 1.5, 0.25)
    assert third.kind is ItemKind.RETURN


def test_the_map_is_that_of_a_sphere_within_its_own_error_bound():
    from math import asin, atan2, degrees, radians

    origin, earth_m = Origin(), 6_371_000.0
    north, east = 80.0, -60.0
    latitude_e7, longitude_e7 = origin.to_global(north, east)
    # The point `d` metres away in direction `b` on the sphere (haversine formulas).
    d, b, lat = 100.0 / earth_m, atan2(east, north), radians(origin.latitude_deg)
    exact_latitude = asin(sin(lat) * cos(d) + cos(lat) * sin(d) * cos(b))
    exact_longitude = radians(origin.longitude_deg) + atan2(
        sin(b) * sin(d) * cos(lat), cos(d) - sin(lat) * sin(exact_latitude))

    error_m = hypot((latitude_e7 * 1e-7 - degrees(exact_latitude)) * 111_195,
                    (longitude_e7 * 1e-7 - degrees(exact_longitude)) * 111_195 * cos(lat))
    assert error_m < 100.0**2 / earth_m * 1.1 + 0.0056 * 1.5       # the bound of the page, and rounding to 1e-7 degrees
    assert origin.to_local(latitude_e7 * 1e-7, longitude_e7 * 1e-7) == pytest.approx((north, east), abs=0.006)
