"""Operations of FMI-LS-BUS: bytes as its header fmi3LsBusCan.h lays them out, and bytes that are none."""

from __future__ import annotations

import struct
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_sim.ecu import operations
from firmware_sim.ecu.operations import (
    Behavior,
    Configuration,
    FormatError,
    Misshapen,
    NodeStatus,
    Parameter,
    Status,
    Transmit,
    Wakeup,
    decode,
)
from netem.media.can.frame import CanFrame
from tests.netem.media.can.frames import frames

TRANSMIT = bytes.fromhex("10000000" "13000000" "23010000" "00" "00" "0300" "aabbcc")
FD_TRANSMIT = bytes.fromhex("11000000" "1d000000" "78563412" "01" "01" "00" "0c00") + bytes(range(12))


def test_operations_have_the_bytes_of_the_standard() -> None:
    assert list(decode(TRANSMIT + FD_TRANSMIT)) == [
        Transmit(CanFrame(0x123, b"\xaa\xbb\xcc")),
        Transmit(CanFrame(0x12345678, bytes(range(12)), extended=True, fd=True, bit_rate_switch=True))]
    assert operations.transmit(CanFrame(0x123, b"\xaa\xbb\xcc")) == TRANSMIT
    assert operations.confirm(0x123) == bytes.fromhex("20000000 0c000000 23010000")
    assert operations.arbitration_lost(0x123) == bytes.fromhex("30000000 0c000000 23010000")
    assert operations.bus_error(0x123, 5, primary=True, is_sender=False) == bytes.fromhex(
        "31000000 0f000000 23010000 05 01 00")
    assert operations.wakeup() == bytes.fromhex("42000000 08000000")
    assert operations.format_error(b"xyz", None) == bytes.fromhex("01000000 0d000000 0300") + b"xyz"


def test_what_an_fmu_configures_and_tells() -> None:
    value = (bytes.fromhex("40000000 0d000000 01") + struct.pack("<I", 500_000)
             + bytes.fromhex("40000000 0a000000 04 02") + bytes.fromhex("41000000 09000000 03")
             + operations.wakeup() + operations.format_error(b"?", None))

    assert list(decode(value)) == [
        Configuration(Parameter.CAN_BAUDRATE, 500_000),
        Configuration(Parameter.ARBITRATION_LOST_BEHAVIOR, Behavior.DISCARD_AND_NOTIFY), Status(NodeStatus.BUS_OFF),
        Wakeup(), FormatError(b"?")]


@given(st.lists(frames, max_size=4))
def test_every_frame_comes_back_from_its_operation(sent: list[CanFrame]) -> None:
    found = list(decode(b"".join(map(operations.transmit, sent))))

    for operation, frame in zip(found, sent, strict=True):
        assert isinstance(operation, Transmit)
        # the data length of the operation cannot say a DLC above 8 of classical CAN
        expected = frame if frame.fd else frame._replace(dlc=-1)
        assert operation.frame._replace(dlc=-1) == expected._replace(dlc=-1)


@pytest.mark.parametrize(("value", "why"), [
    ("1000", "2 bytes: an operation has at least 8"),
    ("10000000 ff000000 00", "operation 0x10 says that it has 255 bytes, 9 are there"),
    ("10000000 07000000", "operation 0x10 says that it has 7 bytes, 8 are there"),
    ("99000000 08000000", "operation 0x99: no operation that an FMU sends to a CAN bus"),
    ("20000000 0c000000 23010000", "operation 0x20: no operation that an FMU sends"),
    ("10000000 13000000 23010000 00 00 0400 aabbcc", "operation 0x10: says 4 bytes of data, 3 are there"),
    ("10000000 13000000 23010000 02 00 0300 aabbcc", "operation 0x10: a flag is 2: expected 0 or 1"),
    ("10000000 13000000 00080000 00 00 0300 aabbcc", "operation 0x10: can_id=0x800: expected 11 bits"),
    ("10000000 19000000 23010000 00 00 0900 000000000000000000", "classical CAN carries at most 8"),
    ("12000000 17000000 23010000 00 00 00 00 00000000 0100 00", "CAN XL is not supported"),
    ("41000000 09000000 09", "operation 0x41: 9 is not a valid NodeStatus"),
    ("40000000 0a000000 04 09", "operation 0x40: 9 is not a valid Behavior"),
    ("40000000 0a000000 01 09", "has 2 bytes of arguments, expected 5"),
    ("40000000 08000000", "operation 0x40"),
    ("42000000 09000000 00", "has 1 bytes of arguments, expected 0"),
])
def test_a_misshapen_operation_is_named_with_its_rule_and_the_next_one_is_read(value: str, why: str) -> None:
    data = bytes.fromhex(value)

    found = list(decode(data + operations.wakeup() if "says that it has" not in why and "at least" not in why
                        else data))

    assert isinstance(found[0], Misshapen)
    assert found[0].data == data
    assert why in found[0].why
    assert found[1:] == ([Wakeup()] if len(found) > 1 else [])


def test_random_bytes_are_operations_or_misshapen_and_nothing_is_lost() -> None:
    rng = Random(7)
    for _ in range(20_000):
        value = bytearray(rng.randbytes(rng.randrange(64)))
        if len(value) >= 8 and rng.random() < 0.8:
            value[:8] = struct.pack("<II", rng.choice((1, 16, 17, 18, 32, 48, 49, 64, 65, 66)),
                                    rng.choice((len(value), rng.randrange(64))))
        found = list(decode(bytes(value)))

        assert bool(found) == bool(value)


def test_a_format_error_repeats_only_what_the_receiver_has_room_for() -> None:
    assert len(operations.format_error(bytes(5000), 2048)) == 2048
    assert len(operations.format_error(bytes(100_000), None)) == 10 + 0xFFFF
