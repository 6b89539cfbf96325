from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from agents.waves.wave_frame import WaveFrame, WaveFrameCodec

CODEC = WaveFrameCodec([2, 4, 2])


def test_a_frame_comes_back_as_it_was_packed():
    data = CODEC.pack(1, 16, [1.5, 0.25, -2.0, 3.0])

    assert len(data) == CODEC.size_bytes(1) == 38
    assert CODEC.unpack(data) == WaveFrame(1, 16, (1.5, 0.25, -2.0, 3.0))


@given(st.binary(max_size=60))
def test_bytes_that_are_no_frame_are_none(data):
    frame = CODEC.unpack(data)

    assert frame is None or CODEC.pack(*frame) == data


def test_a_number_that_is_not_finite_and_an_unknown_sender_are_none():
    assert CODEC.unpack(CODEC.pack(0, 0, [float("nan"), 0.0])) is None
    assert CODEC.unpack(CODEC.pack(0, 0, [float("inf"), 0.0])) is None
    assert CODEC.unpack(CODEC.pack(0, 0, [1.0, -2e100])) is None
    assert CODEC.unpack(b"\xd6\x03" + bytes(20)) is None
    assert CODEC.unpack(CODEC.pack(0, 0, [1.0, 0.0])[:-1]) is None
