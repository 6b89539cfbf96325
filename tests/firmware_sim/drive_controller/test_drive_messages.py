"""Drive messages against bytes made by hand, and whatever else may come over a wire."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_sim.drive_controller.drive_messages import (
    DRIVE_DBC,
    NO_AGE_MS,
    UNITS,
    DriveMessages,
    DriveState,
    FrameRefused,
    Mode,
    Odometry,
    Setpoint,
    Status,
    WheelSpeeds,
    identifiers_in,
)
from netem.media.can.frame import CanFrame, unpack

MESSAGES = DriveMessages()
SCALE = 1e-4            # rad/s


def int24(value: int) -> bytes:
    return struct.pack("<i", value)[:3]


def test_a_setpoint_is_a_socketcan_struct_with_two_24_bit_speeds_mode_and_counter() -> None:
    data = MESSAGES.pack(Setpoint(1.5, -2.0003, Mode.RUN, 250))

    assert data == struct.pack("<IBxxx", 0x110, 8) + int24(15_000) + int24(-20_003) + bytes([1, 250])


def test_the_drives_own_messages_have_their_layout_too() -> None:
    speeds = MESSAGES.pack(WheelSpeeds(-0.0001, 838.0, DriveState.STALE, 7))
    odometry = MESSAGES.pack(Odometry(-(2**31), 2**31 - 1))
    status = MESSAGES.pack(Status(DriveState.RUNNING, 7, 65535, NO_AGE_MS))

    assert speeds == struct.pack("<IBxxx", 0x190, 8) + int24(-1) + int24(8_380_000) + bytes([2, 7])
    assert odometry == struct.pack("<IBxxxii", 0x1A0, 8, -(2**31), 2**31 - 1)
    assert status == struct.pack("<IBxxxBBHI", 0x710, 8, 1, 7, 65535, 0xFFFFFFFF)


@pytest.mark.parametrize("unit", [0, UNITS - 1])
def test_a_check_knows_the_identifiers_of_marconets_own_file(unit: int) -> None:
    known = identifiers_in(DRIVE_DBC, unit)

    assert known == DriveMessages(DRIVE_DBC, unit).identifiers()


@given(st.floats(-500, 500), st.floats(-500, 500), st.sampled_from(Mode), st.integers(0, 255))
def test_a_setpoint_comes_back_to_half_a_step(left: float, right: float, mode: Mode, counter: int) -> None:
    back = MESSAGES.unpack(unpack(MESSAGES.pack(Setpoint(left, right, mode, counter))))

    assert isinstance(back, Setpoint)
    assert abs(back.left_radps - left) <= SCALE / 2 * (1 + 1e-9)
    assert abs(back.right_radps - right) <= SCALE / 2 * (1 + 1e-9)
    assert (back.mode, back.counter) == (mode, counter)


def test_a_unit_moves_every_identifier_and_hears_no_other() -> None:
    third = DriveMessages(unit=3)
    data = third.pack(Setpoint(1.0, 1.0, Mode.RUN, 0))

    assert unpack(data).can_id == 0x113
    assert [third.can_id(kind) for kind in (Setpoint, WheelSpeeds, Odometry, Status)] == [0x113, 0x193, 0x1A3, 0x713]
    assert MESSAGES.unpack(unpack(data)) is None
    ids = [DriveMessages(unit=unit).can_id(kind) for unit in range(UNITS)
           for kind in (Setpoint, WheelSpeeds, Odometry, Status)]
    assert len(set(ids)) == 4 * UNITS
    with pytest.raises(ValueError, match="unit=16: expected 0 to 15, each drive of a bus its own"):
        DriveMessages(unit=16)


@pytest.mark.parametrize(("frame", "reason"), [
    (CanFrame(0x110, bytes(7)), "DriveSetpoint: 7 bytes, expected 8"),
    (CanFrame(0x110), "DriveSetpoint: 0 bytes, expected 8"),
    (CanFrame(0x110, bytes(12), fd=True), "DriveSetpoint: 12 bytes of CAN FD, expected 8"),
    (CanFrame(0x110, bytes(8), fd=True), "DriveSetpoint: 8 bytes of CAN FD, expected 8"),
    (CanFrame(0x110, remote=True, dlc=8), "DriveSetpoint: a remote frame"),
    (CanFrame(0x110, int24(5_000_001) + bytes(5)), "DriveSetpoint: left_radps=500.0001: expected at most 500"),
    (CanFrame(0x110, bytes(3) + int24(-(2**23)) + bytes(2)),
     "DriveSetpoint: right_radps=-838.8608: expected at least -500"),
    (CanFrame(0x110, bytes(6) + b"\x02\x00"), "DriveSetpoint: mode=2: expected one of 0 STOP, 1 RUN"),
    (CanFrame(0x190, bytes(6) + b"\x03\x00"), "DriveSpeed: state=3: expected one of 0 STOPPED, 1 RUNNING, 2 STALE"),
])
def test_a_frame_that_is_no_valid_message_is_refused_with_its_reason(frame: CanFrame, reason: str) -> None:
    with pytest.raises(FrameRefused) as caught:
        MESSAGES.unpack(frame)

    assert str(caught.value) == reason


@pytest.mark.parametrize("frame", [
    CanFrame(0x111, bytes(8)), CanFrame(0x110, bytes(8), extended=True), CanFrame(0x110, bytes(8), error=True)])
def test_what_is_not_for_this_drive_is_no_message(frame: CanFrame) -> None:
    assert MESSAGES.unpack(frame) is None
    assert MESSAGES.kind_of(frame) is None


@given(st.sampled_from([0x110, 0x190, 0x1A0, 0x710]), st.binary(max_size=64), st.booleans(), st.booleans())
def test_no_bytes_raise_anything_but_a_refusal(can_id: int, data: bytes, fd: bool, remote: bool) -> None:
    frame = CanFrame(can_id, data, fd=fd, remote=remote)

    try:
        message = MESSAGES.unpack(frame)
    except FrameRefused:
        return

    assert type(message) is MESSAGES.kind_of(frame)
    assert MESSAGES.pack(message)[8:] == data                   # type: ignore[arg-type]


@pytest.mark.parametrize("message", [
    Setpoint(500.1, 0.0, Mode.RUN, 0), Setpoint(float("nan"), 0.0, Mode.RUN, 0), Setpoint(0.0, 0.0, Mode.RUN, 256),
    Status(DriveState.STOPPED, 0, 65536, 0), Odometry(2**31, 0)])
def test_a_sender_learns_that_its_value_does_not_fit(message: Setpoint) -> None:
    with pytest.raises(ValueError, match=r"^\w+\("):
        MESSAGES.pack(message)
