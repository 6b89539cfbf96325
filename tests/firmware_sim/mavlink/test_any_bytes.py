"""Whatever comes in: the board goes on, and what is no message for this vehicle does not change it.

The seeds are fixed, so a failure repeats; 400 streams of some hundred bytes each, on top of every kind of message with
random fields.
"""

import struct
from math import inf, isfinite, nan
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common

from firmware_sim.autopilot.airframe import Airframe
from firmware_sim.autopilot.flight_controller import FlightController
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from firmware_sim.mavlink.dialect import layout_of, message, pack
from firmware_sim.mavlink.enums import Command
from firmware_sim.mavlink.framing import build
from firmware_sim.mavlink.settings import MavlinkSettings
from firmware_sim.mavlink.task import MavlinkTask
from netem.node.node import Node
from netem.wire.messages import Grant
from tests.firmware_sim.mavlink.ground import TICK_NS, Ground

TELLING = ("COMMAND_LONG", "COMMAND_INT", "MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ITEM", "PARAM_SET",
           "SET_POSITION_TARGET_LOCAL_NED", "SET_ATTITUDE_TARGET", "MISSION_SET_CURRENT", "PARAM_REQUEST_READ")
EDGES = (nan, inf, -inf, 0.0, -1.0, 3.4e38, 1e-45)


def standing(vehicle):
    """All that a message could change."""
    return (vehicle.position, vehicle.goal, vehicle.yaw, vehicle.armed, vehicle.mode, vehicle.index, vehicle.mission,
            dict(vehicle.parameters.values), list(vehicle.targets), list(vehicle.heard_ns), list(vehicle.calls))


def commands(ground):
    """Messages that would change the vehicle if they got through."""
    mav = ground.mav
    return [mav.command_long_encode(1, 1, 400, 0, 1, 21196, 0, 0, 0, 0, 0),
            mav.param_set_encode(1, 1, b"NAV_ACC_RAD", 1.0, 9), mav.mission_clear_all_encode(1, 1),
            mav.heartbeat_encode(6, 8, 0, 0, 4), mav.mission_set_current_encode(1, 1, 0),
            mav.set_position_target_local_ned_encode(0, 1, 1, 1, 0xDF8, 1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0),
            mav.command_long_encode(1, 1, 22, 0, 0, 0, 0, 0, 0, 0, 490)]


@given(st.lists(st.binary(max_size=300), max_size=8))
def test_random_bytes_change_nothing(chunks):
    ground = Ground()
    before = standing(ground.vehicle)

    for chunk in chunks:
        ground.tick(chunk)

    assert standing(ground.vehicle) == before


@pytest.mark.parametrize("seed", range(400))
def test_frames_with_flipped_missing_or_added_bytes_change_nothing(seed):
    """A damaged frame gets through with a probability of 2^-16 for each candidate; with these seeds none does."""
    rng = Random(seed)
    ground = Ground()
    before = standing(ground.vehicle)

    for theirs in commands(ground):
        data = bytearray(ground.pack(theirs))
        damage = rng.randrange(4)
        place = rng.randrange(len(data))
        if damage == 0:
            data[place] ^= 1 << rng.randrange(8)
        elif damage == 1:
            del data[place:]
        elif damage == 2:
            del data[place]
        else:
            data[place:place] = bytes((data[place] ^ 0x55,))
            if place == 0:                  # noise before a whole frame: that one would be heard
                del data[-1]
        for _ in range(40):                 # time for begins to be given up
            ground.tick(bytes(data))
            data = b""

    assert standing(ground.vehicle) == before


def test_unsigned_and_replayed_frames_change_nothing_where_signatures_are_asked_for():
    ground = Ground(signing_key="07" * 32)
    signing = Ground()
    signing.mav.signing.secret_key, signing.mav.signing.sign_outgoing = b"\x07" * 32, True
    once = [ground_frame for theirs in commands(signing) for ground_frame in [signing.pack(theirs)]]
    unsigned = [ground.pack(theirs) for theirs in commands(ground)]

    before = standing(ground.vehicle)
    for data in unsigned:
        ground.tick(data)
    unchanged = standing(ground.vehicle) == before
    for data in once:
        ground.tick(data)
    after = standing(ground.vehicle)
    for data in once:
        ground.tick(data)
    ground.vehicle.advance(ground.now_ns)
    replayed = standing(ground.vehicle)

    assert unchanged
    assert after[9] != before[9]            # they were heard
    assert replayed[5:] == after[5:]        # it climbs meanwhile, but nobody was heard again
    assert ground.front.counts["frames refused: unsigned"] == len(unsigned)
    assert ground.front.counts["frames refused: replayed"] == len(once)


def test_messages_of_others_and_for_others_change_nothing():
    ground = Ground()
    before = standing(ground.vehicle)

    for theirs in commands(ground):
        values = {name: getattr(theirs, name) for name in theirs.get_fieldnames()}
        fields = {name: value.encode() if isinstance(value, str) else value for name, value in values.items()}
        if theirs.get_type() == "HEARTBEAT":
            fields["type"] = common.MAV_TYPE_FIXED_WING
        else:
            fields["target_system"] = 2
        ground.tick(build(layout_of(theirs.get_type()), pack(message(theirs.get_type(), **fields)), 0, 7, 1))

    assert standing(ground.vehicle) == before


class Hanging(FlightController):
    """The real flight controller, whose sensors say that it hangs level and still, where motion capture sees it."""

    def __init__(self):
        super().__init__(Airframe(), 1_000_000, 10)
        self.motors = set()

    def advance(self, now_ns):
        if now_ns % 10_000_000 == 0:
            self.captured(now_ns - 10_000_000, (0.0, 0.0, -2.0), now_ns)
        for k in range(TICK_NS // 1_000_000):
            self.motors.update(self.tick(now_ns + k * 1_000_000, (1.0, 0.0, 0.0, 0.0), (0.0,) * 3, (0.0, 0.0, -9.81)))


def fly_up(ground):
    for _ in range(100):
        ground.tick()
    ground.command(400, 1)
    ground.command(22, *[nan] * 7)
    for _ in range(100):
        ground.tick()
    assert ground.vehicle.state().armed


@pytest.mark.parametrize("seed", range(12))
def test_every_kind_of_message_with_any_fields_is_survived(seed):
    """They are valid frames for this vehicle, so they may act; the board goes on and its state stays finite."""
    rng = Random(seed)
    ground = Ground(vehicle=Hanging() if seed % 2 else None)
    fly_up(ground)

    for number in sorted(common.mavlink_map):
        found = layout_of(common.mavlink_map[number].msgname)
        for _ in range(100 if found.name in TELLING else 5):
            payload = bytearray(rng.randbytes(found.wire.size))
            place = 0
            for name, kind in zip((name for name, _ in found.fields), _kinds(found), strict=False):
                size = struct.calcsize("<" + kind)
                if kind == "f" and rng.random() < 0.7:
                    payload[place:place + 4] = struct.pack("<f", rng.choice((*EDGES, rng.uniform(-20, 20))))
                if name == "command":
                    payload[place:place + 2] = struct.pack("<H", rng.choice(list(Command)))
                if name in ("frame", "coordinate_frame", "mission_type", "count", "seq", "param_type"):
                    payload[place:place + size] = rng.choice((0, 1, 3, 6, 9)).to_bytes(size, "little")
                if name in ("target_system", "target_component"):
                    payload[place] = rng.choice((0, 1))
                place += size
            ground.tick(build(found, bytes(payload), ground.mav.seq, 255, 190))
            ground.mav.seq = (ground.mav.seq + 1) % 256
    state = ground.vehicle.state()

    values = [ground.vehicle.parameters.get(name) for name in ground.vehicle.parameters.infos]
    assert all(map(isfinite, (*state.position_ned_m, *state.velocity_ned_mps, *values)))
    assert all(map(isfinite, getattr(ground.vehicle, "motors", ())))
    assert ground.command(common.MAV_CMD_REQUEST_MESSAGE, common.MAVLINK_MSG_ID_HEARTBEAT)[0] == 0


def test_a_flood_is_cut_at_the_receive_buffer_and_the_streams_go_on():
    node = Node("vehicle", ["telemetry"])
    board = Board(node, LocalClock(ClockSettings(), node.env.time_ns), None, {}, Random(1), {})
    ground = Ground()
    task = MavlinkTask(board, ["telemetry"], ground.vehicle, MavlinkSettings(receive_buffer_bytes=1000))
    node.start(task.run())
    flood = [(at_ns, 0, b"\xfd" * 280) for at_ns in range(0, 1_000_000_000, 100_000)]     # 2.8 MB in a second

    report = node.advance(Grant(1, 1_000_000_000, False, True, flood))

    periods, in_a_period = 1_000_000_000 // TICK_NS, 280 * TICK_NS // 100_000
    assert report.counters["mavlink noise bytes"] <= periods * 1000
    assert report.counters["mavlink bytes overrun"] >= 280 * len(flood) - periods * 1000 - in_a_period
    assert len([offer for offer in report.offers if offer[2][7:10] == b"\x00\x00\x00"]) == 1      # its heartbeat


def _kinds(found):
    """The struct codes of a layout, one for each field (arrays: their first element, which is enough here)."""
    codes, text, digits = [], found.wire.format.lstrip("<"), ""
    for char in text:
        if char.isdigit():
            digits += char
            continue
        codes.append(f"{digits}{char}")
        digits = ""
    return codes
