"""The bytes of a can port, against python-can's own reading and writing of SocketCAN's structs."""

import can
import pytest
from can.interfaces.socketcan.socketcan import build_can_frame, dissect_can_frame
from hypothesis import given
from hypothesis import strategies as st

from netem.media.can.encoded_frame import encode_frame
from netem.media.can.frame import CLASSICAL_BYTES, FD_BYTES, CanFrame, MalformedFrame, fd_length, pack, unpack
from tests.netem.media.can.frames import frames


def message(frame: CanFrame) -> can.Message:
    return can.Message(arbitration_id=frame.can_id, is_extended_id=frame.extended, is_remote_frame=frame.remote,
                       data=frame.data, is_fd=frame.fd, bitrate_switch=frame.bit_rate_switch,
                       error_state_indicator=frame.error_state, dlc=frame.dlc if frame.remote else len(frame.data))


@given(frame=frames)
def test_python_can_reads_what_pack_writes(frame: CanFrame) -> None:
    can_id, _, flags, data = dissect_can_frame(pack(frame))

    assert can_id == frame.can_id | 0x80000000 * frame.extended | 0x40000000 * frame.remote
    assert flags & 3 == (frame.bit_rate_switch | frame.error_state << 1 if frame.fd else 0)
    assert frame.remote or data == frame.data


@given(frame=frames.filter(lambda frame: not frame.remote or frame.dlc <= 8))
def test_unpack_reads_what_python_can_writes(frame: CanFrame) -> None:
    found = unpack(build_can_frame(message(frame)))

    assert found == unpack(pack(frame))
    assert found._replace(dlc=frame.dlc) == frame


@given(data=st.one_of(st.binary(max_size=80), st.binary(min_size=CLASSICAL_BYTES, max_size=CLASSICAL_BYTES),
                      st.binary(min_size=FD_BYTES, max_size=FD_BYTES)))
def test_any_bytes_are_a_frame_or_a_malformed_one_with_a_reason(data: bytes) -> None:
    reason = frame = None
    try:
        frame = unpack(data)
    except MalformedFrame as malformed:
        reason = str(malformed)

    assert frame is not None or 0 < len(str(reason)) < 80
    assert frame is None or unpack(pack(frame)) == frame
    assert frame is None or frame.error or encode_frame(data).data == pack(frame)


def struct_of(can_id: int = 0x123, length: int = 0, size: int = CLASSICAL_BYTES) -> bytes:
    return can_id.to_bytes(4, "little") + bytes((length,)) + bytes(size - 5)


@pytest.mark.parametrize(("data", "reason"), [
    (b"", "0 bytes"), (bytes(15), "15 bytes"), (bytes(17), "17 bytes"),
    (struct_of(length=9), "length 9"), (struct_of(length=9, size=FD_BYTES), "length 9"),
    (struct_of(length=65, size=FD_BYTES), "length 65"),
    (struct_of(0x800), "0x800"), (struct_of(0x40000123, size=FD_BYTES), "remote frame of CAN FD"),
])
def test_malformed_structs_say_why(data: bytes, reason: str) -> None:
    with pytest.raises(MalformedFrame, match=reason):
        unpack(data)


@pytest.mark.parametrize("frame", [
    CanFrame(0x800), CanFrame(-1), CanFrame(1 << 29, extended=True), CanFrame(1, bytes(9)),
    CanFrame(1, bytes(65), fd=True), CanFrame(1, b"1", remote=True), CanFrame(1, remote=True, fd=True),
    CanFrame(1, b"12", dlc=3), CanFrame(1, dlc=16), CanFrame(1, bytes(12), fd=True, dlc=12),
])
def test_what_is_no_frame_is_not_packed(frame: CanFrame) -> None:
    with pytest.raises(MalformedFrame):
        pack(frame)


def test_a_can_fd_payload_is_filled_up_to_the_next_length_as_linux_does() -> None:
    assert unpack(pack(CanFrame(1, b"123456789", fd=True))).data == b"123456789\0\0\0"
    assert [fd_length(length) for length in (0, 8, 9, 33, 64)] == [0, 8, 12, 48, 64]


def test_bytes_beyond_the_payload_do_not_get_to_the_bus() -> None:
    dirty = struct_of(length=2)[:8] + b"ab" + b"secret"

    assert encode_frame(dirty).data == struct_of(length=2)[:8] + b"ab" + bytes(6)
