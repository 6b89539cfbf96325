"""The ground's client, with pymavlink's own parser beside it and a MAVLink front at the other end of a lossy link."""

from __future__ import annotations

from math import nan

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common

from firmware_sim.autopilot.vehicle import Mode, PositionTarget
from firmware_sim.mavlink.enums import Command, CommandResult
from firmware_sim.mavlink.ground_client import GroundClient
from tests.firmware_sim.mavlink.ground import Ground

MS = 1_000_000
RETRY_NS = 500 * MS


def parser():
    """Reads as somebody else would."""
    mav = common.MAVLink(None)
    mav.robust_parsing = True
    return mav


def vehicle_says(message, system=1):
    mav = common.MAVLink(None, srcSystem=system, srcComponent=1)
    return message(mav).pack(mav)


def sent(client, until_ns, step_ns=70 * MS, from_ns=0):
    """(time, message) of all that goes out, as pymavlink reads it, without heartbeats."""
    mav = parser()
    return [(now_ns, message) for now_ns in range(from_ns, until_ns, step_ns) for data in client.due(now_ns)
            for message in mav.parse_buffer(data) or [] if message.get_type() != "HEARTBEAT"]


def acknowledge(client, now_ns, command=400, result=0, system=255):
    client.receive(vehicle_says(lambda mav: mav.command_ack_encode(command, result, 0, 0, system, 190)), now_ns)


# --- orders

def test_an_order_is_sent_again_with_a_growing_confirmation_and_given_up_after_five_attempts():
    client = GroundClient(retry_ns=RETRY_NS, attempts=5)
    client.order(Command.COMPONENT_ARM_DISARM, 1.0)

    found = sent(client, 4_000 * MS, step_ns=100 * MS)

    assert [now_ns for now_ns, _ in found] == [k * RETRY_NS for k in range(5)]
    assert [(message.command, message.confirmation, message.param1) for _, message in found] == [
        (400, k, 1.0) for k in range(5)]
    assert {(message.target_system, message.target_component) for _, message in found} == {(1, 1)}
    assert not client.busy
    assert client.result is None
    assert (client.counts["orders sent again"], client.counts["orders unanswered"]) == (4, 1)


@pytest.mark.parametrize("result", list(CommandResult))
def test_an_acknowledgement_ends_the_order_with_its_result(result):
    client = GroundClient()
    client.order(Command.COMPONENT_ARM_DISARM, 1.0)
    sent(client, 100 * MS)

    acknowledge(client, 100 * MS, result=result)

    assert not client.busy
    assert client.result is result
    assert sent(client, 3_000 * MS, from_ns=200 * MS) == []


def test_an_acknowledgement_of_another_order_a_second_one_or_one_for_somebody_else_counts_for_nothing():
    client = GroundClient()
    client.order(Command.COMPONENT_ARM_DISARM, 1.0)
    acknowledge(client, 0)                      # it was not even sent
    sent(client, 1)

    acknowledge(client, 10 * MS, command=22)
    acknowledge(client, 20 * MS, system=254)
    still = client.busy
    acknowledge(client, 30 * MS)
    acknowledge(client, 40 * MS)

    assert still
    assert not client.busy
    assert client.counts["acknowledgements of no order"] == 3
    assert client.counts["frames for others"] == 1


def test_a_vehicle_whose_answers_are_lost_carries_an_order_out_once():
    ground, client = Ground(), GroundClient()
    client.order(Command.COMPONENT_ARM_DISARM, 1.0)
    answers = 0

    while client.busy:
        frames = ground.front.step(b"".join(client.due(ground.now_ns)), ground.now_ns)
        for frame in frames:
            answers += 1
            if answers > 3:                     # the first three never arrive
                client.receive(frame, ground.now_ns)
        ground.now_ns += 5 * MS

    assert client.result is CommandResult.ACCEPTED
    assert client.counts["orders sent again"] >= 1
    assert ground.vehicle.calls == ["arm False"]


# --- targets and heartbeats

def test_a_target_is_read_by_others_as_position_and_yaw_and_by_the_vehicle_as_that_target():
    client, ground = GroundClient(), Ground()
    data = client.target((1.5, -2.25, -1.0), 0.5, 7_000 * MS)

    (message,) = parser().parse_buffer(data)
    ground.front.step(data, 5 * MS)

    assert (message.x, message.y, message.z, message.yaw, message.time_boot_ms) == (1.5, -2.25, -1.0, 0.5, 7_000)
    ignored = (common.POSITION_TARGET_TYPEMASK_VX_IGNORE | common.POSITION_TARGET_TYPEMASK_VY_IGNORE
               | common.POSITION_TARGET_TYPEMASK_VZ_IGNORE | common.POSITION_TARGET_TYPEMASK_AX_IGNORE
               | common.POSITION_TARGET_TYPEMASK_AY_IGNORE | common.POSITION_TARGET_TYPEMASK_AZ_IGNORE
               | common.POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE)
    assert message.type_mask == ignored
    assert message.coordinate_frame == common.MAV_FRAME_LOCAL_NED
    assert ground.vehicle.targets == [PositionTarget((1.5, -2.25, -1.0), yaw_rad=0.5)]


def test_heartbeats_of_a_ground_station_go_out_once_a_second():
    client, mav = GroundClient(), parser()

    found = [(now_ns, message) for now_ns in range(0, 5_000 * MS, 50 * MS) for data in client.due(now_ns)
             for message in mav.parse_buffer(data)]

    assert [now_ns for now_ns, _ in found] == [k * 1_000 * MS for k in range(5)]
    assert {(message.get_type(), message.type) for _, message in found} == {("HEARTBEAT", common.MAV_TYPE_GCS)}


# --- what the vehicle tells

def test_it_knows_what_its_vehicle_told_last_and_nothing_of_others():
    client = GroundClient()
    offboard = 6 << 16

    client.receive(vehicle_says(lambda mav: mav.heartbeat_encode(2, 12, 128, offboard, 4)), 10)
    client.receive(vehicle_says(lambda mav: mav.local_position_ned_encode(0, 1.0, 2.0, -3.0, 0, 0, 0)), 20)
    client.receive(vehicle_says(lambda mav: mav.heartbeat_encode(2, 12, 0, 0, 3), system=2), 30)

    told = client.told
    assert (told.heartbeat_ns, told.armed, told.mode) == (10, True, Mode.OFFBOARD)
    assert (told.position_ns, told.position_ned_m) == (20, (1.0, 2.0, -3.0))
    assert client.counts["frames of others"] == 1


def test_a_position_that_is_no_place_is_none():
    client = GroundClient()

    client.receive(vehicle_says(lambda mav: mav.local_position_ned_encode(0, 1.0, nan, -3.0, 0, 0, 0)), 20)

    assert client.told.position_ns == -1
    assert client.counts["positions that are not finite"] == 1


@given(st.lists(st.binary(max_size=200), max_size=8))
def test_any_bytes_at_all_change_nothing(chunks):
    client = GroundClient()
    client.order(Command.COMPONENT_ARM_DISARM, 1.0)
    client.due(0)

    for k, chunk in enumerate(chunks):
        client.receive(chunk, k)

    assert client.busy
    assert client.told == GroundClient().told


@pytest.mark.parametrize("wrong", [{"retry_ns": 0}, {"attempts": 0}])
def test_nonsense_is_refused(wrong):
    with pytest.raises(ValueError, match="expected at least 1"):
        GroundClient(**wrong)
