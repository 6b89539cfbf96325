"""Random CAN frames for property tests, many of them with long runs of equal bits."""

from __future__ import annotations

from hypothesis import strategies as st

from netem.media.can.frame import FD_LENGTHS, CanFrame


def payloads(length: int) -> st.SearchStrategy[bytes]:
    runs = st.lists(st.sampled_from([0x00, 0xFF, 0x0F, 0xF0, 0x83, 0x7C, 0x1F, 0xC1]), min_size=length, max_size=length)
    return st.one_of(st.binary(min_size=length, max_size=length), runs.map(bytes))


identifiers = st.booleans().flatmap(lambda extended: st.tuples(
    st.one_of(st.integers(0, 0x1FFFFFFF if extended else 0x7FF),
              st.sampled_from([0, 0x1FFFFFFF, 0x1F, 0x1FFF0000] if extended else [0, 0x7FF, 0x7C0, 0x1F])),
    st.just(extended)))

data_frames = st.integers(0, 8).flatmap(payloads).flatmap(
    lambda data: identifiers.map(lambda one: CanFrame(one[0], data, one[1])))
remote_frames = st.tuples(identifiers, st.integers(0, 15)).map(
    lambda one: CanFrame(one[0][0], extended=one[0][1], remote=True, dlc=one[1]))
fd_frames = st.tuples(identifiers, st.sampled_from(FD_LENGTHS).flatmap(payloads), st.booleans(), st.booleans()).map(
    lambda one: CanFrame(one[0][0], one[1], one[0][1], fd=True, bit_rate_switch=one[2], error_state=one[3]))
classical_frames = st.one_of(data_frames, remote_frames)
frames = st.one_of(data_frames, remote_frames, fd_frames)
