"""Frames, payloads, checksums and signatures against pymavlink's own parser and generator."""

import struct
from hashlib import sha256
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega, common

from firmware_sim.mavlink import enums
from firmware_sim.mavlink.dialect import layout, layout_of, message, pack, unpack
from firmware_sim.mavlink.framing import HEADER_BYTES, FrameReader, build
from firmware_sim.mavlink.link import INCOMPLETE_NS, MavlinkLink
from firmware_sim.mavlink.signing import Signing

KEY = bytes(range(32))
SECOND_NS = 10**9


def ground(signed=False, system=255, component=190):
    """pymavlink as the other end."""
    mav = common.MAVLink(None, srcSystem=system, srcComponent=component)
    mav.robust_parsing = True
    if signed:
        mav.signing.secret_key, mav.signing.sign_outgoing, mav.signing.timestamp = KEY, True, 1_000_000
    return mav


def packed(mav, message_of_theirs):
    data = message_of_theirs.pack(mav)
    mav.seq = (mav.seq + 1) % 256
    return data


def ping(mav, number=0):
    return packed(mav, mav.ping_encode(1, number, 0, 0))


def random_message(number, rng):
    """One of pymavlink's messages with random field values, and those values by name."""
    cls = common.mavlink_map[number]
    values = {}
    counts = [cls.array_lengths[k] for k in cls.orders]
    for name, count, kind in zip(cls.fieldnames, counts, cls.fieldtypes, strict=True):
        if kind == "char":
            text = bytes(rng.randrange(32, 127) for _ in range(rng.randrange(max(count, 1) + 1)))
            values[name] = text if count else (text or b"a")[:1]
            continue
        def one(kind=kind):
            if kind in ("float", "double"):
                return struct.unpack("<f", struct.pack("<f", rng.uniform(-1e3, 1e3)))[0]
            bits = int("".join(filter(str.isdigit, kind)).removesuffix("_"))
            low = 0 if kind.startswith("u") else -(1 << bits - 1)
            return rng.randrange(low, low + (1 << bits))
        values[name] = [one() for _ in range(count)] if count else one()
    return cls(**values), values


@pytest.mark.parametrize("number", sorted(common.mavlink_map))
def test_every_message_has_the_bytes_of_pymavlink_and_is_read_back(number):
    rng = Random(number)
    theirs, values = random_message(number, rng)
    mav = ground()
    mav.seq = rng.randrange(256)

    ours = build(layout(number), pack(message(theirs.msgname, **values)), mav.seq, 255, 190)
    (frame,) = FrameReader().read(theirs.pack(mav))

    assert ours == theirs.pack(mav)
    found = unpack(frame.layout, frame.payload)
    assert found.name == theirs.msgname
    assert {name: list(value) if isinstance(value, tuple) else value for name, value in found.fields.items()} == values


def test_the_numbers_are_those_of_common_xml():
    prefixes = {enums.Command: "MAV_CMD_", enums.CommandResult: "MAV_RESULT_", enums.MissionResult: "MAV_MISSION_",
                enums.Frame: "MAV_FRAME_", enums.ModeFlag: "MAV_MODE_FLAG_", enums.SystemState: "MAV_STATE_",
                enums.LandedState: "MAV_LANDED_STATE_", enums.Capability: "MAV_PROTOCOL_CAPABILITY_",
                enums.Sensor: "MAV_SYS_STATUS_", enums.PositionIgnore: "POSITION_TARGET_TYPEMASK_",
                enums.AttitudeIgnore: "ATTITUDE_TARGET_TYPEMASK_"}

    wrong = [f"{prefix}{member.name}" for cls, prefix in prefixes.items() for member in cls
             if getattr(common, prefix + member.name, None) != member.value]

    assert wrong == []
    assert enums.TYPE_QUADROTOR == common.MAV_TYPE_QUADROTOR
    assert enums.AUTOPILOT_PX4 == common.MAV_AUTOPILOT_PX4
    assert enums.PARAM_TYPE_REAL32 == common.MAV_PARAM_TYPE_REAL32
    assert enums.GPS_FIX_TYPE_3D_FIX == common.GPS_FIX_TYPE_3D_FIX


@given(st.integers(1, 40), st.randoms(use_true_random=False))
def test_frames_arrive_however_the_stream_is_cut(cut, rng):
    mav = ground()
    stream = b"".join(ping(mav, k) for k in range(20))
    link = MavlinkLink(1, 1)
    found, rest = [], stream
    while rest:
        size = rng.randrange(1, cut + 1)
        found += link.receive(rest[:size], 0)
        rest = rest[size:]

    assert [heard.message["seq"] for heard in found] == list(range(20))
    assert link.counts["noise bytes"] == 0


@given(st.lists(st.one_of(st.just(None), st.binary(max_size=40)), max_size=30))
def test_frames_between_noise_are_found_and_every_other_byte_is_counted(parts):
    mav = ground()
    stream = b"".join(ping(mav, k) if part is None else part.replace(b"\xfd", b"\xfc") for k, part in enumerate(parts))
    expected = [k for k, part in enumerate(parts) if part is None]
    link = MavlinkLink(1, 1)

    found = link.receive(stream, 0)

    assert [heard.message["seq"] for heard in found] == expected
    assert link.counts["noise bytes"] == sum(len(part) for part in parts if part is not None)


@given(st.binary(max_size=400), st.randoms(use_true_random=False))
def test_after_any_bytes_whatever_a_frame_is_heard_again_once_the_line_was_quiet(noise, rng):
    mav = ground()
    link = MavlinkLink(1, 1)
    link.receive(noise, 0)
    now_ns = 0
    for _ in range(len(noise) + 1):                 # each silence gives up one begin at least
        now_ns += INCOMPLETE_NS
        link.receive(b"", now_ns)

    (heard,) = link.receive(ping(mav, 7), now_ns)

    assert heard.message["seq"] == 7


def test_frames_of_another_dialect_are_skipped_whole_and_counted():
    mav = ground()
    other = ardupilotmega.MAVLink(None, srcSystem=7, srcComponent=1)
    ahrs = other.ahrs_encode(*(0.25,) * 7).pack(other)
    link = MavlinkLink(1, 1)

    found = link.receive(ahrs + ping(mav, 1) + ahrs + ahrs + ping(mav, 2) + ahrs, 0)

    assert layout(163) is None
    assert [heard.message["seq"] for heard in found] == [1, 2]
    assert (link.counts["unknown messages"], link.counts["noise bytes"]) == (4, 0)


def test_frames_of_mavlink_1_are_noise():
    mav = ground()
    link = MavlinkLink(1, 1)
    first = mav.heartbeat_encode(6, 8, 0, 0, 4).pack(mav, force_mavlink1=True)

    (heard,) = link.receive(first + ping(mav, 1), 0)

    assert heard.message["seq"] == 1
    assert link.counts["noise bytes"] == len(first)


def test_a_frame_hidden_in_a_broken_one_is_found():
    mav = ground()
    inner = ping(mav, 3)
    broken = bytearray(packed(mav, mav.statustext_encode(6, b"x" * 40)))
    broken[HEADER_BYTES:HEADER_BYTES + len(inner)] = inner
    link = MavlinkLink(1, 1)

    found = link.receive(bytes(broken), 0)

    assert [heard.message["seq"] for heard in found] == [3]
    assert link.counts["bad checksums"] >= 1


def test_each_way_to_fail_has_its_counter():
    mav = ground()
    good = ping(mav)
    flipped = bytearray(good)
    flipped[12] ^= 1
    flagged = bytearray(good)
    flagged[2] = 0x04
    unknown = bytearray(good)
    unknown[7:10] = (200_000).to_bytes(3, "little")
    link = MavlinkLink(1, 1)

    for data in (flipped, flagged, unknown, packed(mav, mav.ping_encode(1, 0, 2, 0)),
                 packed(mav, mav.ping_encode(1, 0, 1, 77)), ping(ground(system=1, component=1)), good[:9]):
        link.receive(bytes(data), 0)

    assert link.receive(b"", INCOMPLETE_NS) == []
    counts = link.counts
    assert {name: counts[name] for name in ("bad checksums", "unknown flags", "unknown messages", "frames for others",
                                            "own frames heard", "incomplete frames")} == {
        "bad checksums": 1, "unknown flags": 1, "unknown messages": 1, "frames for others": 2, "own frames heard": 1,
        "incomplete frames": 1}


# --- signing

def signed_link(**settings):
    return MavlinkLink(1, 1, Signing(KEY, clock_began_ticks=1_000_000, **settings))


def test_what_is_signed_is_taken_by_pymavlink_and_the_other_way_round():
    theirs, ours = ground(signed=True), signed_link()

    (heard,) = theirs.parse_buffer(ours.send(message("PING", seq=5), 0))
    (taken,) = ours.receive(ping(theirs, 6), 0)

    assert (heard.get_type(), heard.get_signed(), heard.seq) == ("PING", True, 5)
    assert (taken.message["seq"], taken.signed) == (6, True)


def test_a_signature_is_the_hash_that_the_guide_prescribes():
    frame = signed_link(link_id=3).send(message("PING"), 20_000)

    stamp = frame[-13:-6]
    assert stamp == b"\x03" + (1_000_002).to_bytes(6, "little")
    assert frame[-6:] == sha256(KEY + frame[:-6]).digest()[:6]


def test_unsigned_forged_and_replayed_frames_are_refused():
    theirs, link = ground(signed=True), signed_link()
    link.signing.clock_began_ticks = theirs.signing.timestamp = 10_000_000
    first, second = ping(theirs, 1), ping(theirs, 2)
    forged = bytearray(ping(theirs, 3))
    forged[-1] ^= 1
    stale = ground(signed=True, component=7)
    stale.signing.timestamp = 10_000_000 + 100_000 - 6_000_001       # a new stream, more than a minute behind

    taken = [link.receive(data, SECOND_NS) for data in
             (second, first, second, bytes(forged), ping(ground()), ping(stale))]

    assert [len(found) for found in taken] == [1, 0, 0, 0, 0, 0]
    assert {name: count for name, count in link.counts.items() if name.startswith("frames refused")} == {
        "frames refused: replayed": 3, "frames refused: wrong signature": 1, "frames refused: unsigned": 1}


def test_a_forged_timestamp_locks_nobody_out():
    theirs, link = ground(signed=True), signed_link()
    forged = bytearray(ping(theirs))
    forged[-12:-6] = b"\xff" * 6

    assert link.receive(bytes(forged), 0) == []
    assert len(link.receive(ping(theirs), 0)) == 1


def test_timestamps_follow_the_vehicles_clock_and_never_stand_still():
    link = signed_link()

    stamps = [int.from_bytes(link.send(message("PING"), at_ns)[-12:-6], "little") for at_ns in (0, 0, SECOND_NS, 0)]

    assert stamps == [1_000_000, 1_000_001, 1_100_000, 1_100_001]


def test_unsigned_frames_are_taken_where_that_is_said():
    assert len(signed_link(accept_unsigned=True).receive(ping(ground()), 0)) == 1


# --- statistics

def test_missing_frames_are_counted_by_source_also_over_the_end_of_the_counter():
    link = MavlinkLink(1, 1)
    for system, numbers in ((255, (254, 255, 2, 3)), (7, (0, 1, 1, 2))):
        for number in numbers:
            mav = ground(system=system)
            mav.seq = number
            link.receive(ping(mav), 0)

    found = {what: number for what, number in link.counts.items() if what.startswith("frames ")}

    assert found == {"frames taken": 8, "frames lost": 2, "frames lost from 255/190": 2}


def test_a_source_that_starts_again_is_not_late_for_ever():
    link = MavlinkLink(1, 1)
    for number in (200, 0, 1, 2, 5):
        mav = ground()
        mav.seq = number
        link.receive(ping(mav), 0)

    assert link.counts["frames lost"] == 55 + 2


def test_an_own_message_with_a_wrong_field_is_refused():
    with pytest.raises(AssertionError, match="PING has no field"):
        message("PING", sec=1)
    assert layout_of("PING").id == 4
