import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.synchronization.discovery_frame import MAX_BYTES, MAX_NODES, DiscoveryFrame, decode, frame_bytes


@st.composite
def frames(draw):
    nodes = draw(st.integers(1, MAX_NODES))
    records = tuple(draw(st.integers(0, 2**nodes - 1)) & ~(1 << i) for i in range(nodes))
    return DiscoveryFrame(draw(st.integers(0, nodes - 1)), draw(st.integers(0, 2**16 - 1)),
                          draw(st.integers(0, 2**32 - 1)), records)


@given(frames())
def test_a_frame_comes_back_as_it_was_sent(frame):
    data = frame.encode()

    assert decode(data, len(frame.records)) == frame
    assert len(data) == frame_bytes(len(frame.records)) <= MAX_BYTES


@given(frames(), st.data())
def test_a_cut_or_longer_frame_and_one_among_another_number_of_nodes_is_nothing(frame, data):
    sent, nodes = frame.encode(), len(frame.records)

    assert decode(sent[:data.draw(st.integers(0, len(sent) - 1))], nodes) is None
    assert decode(sent + b"\0", nodes) is None
    assert all(decode(sent, other) is None for other in range(1, MAX_NODES + 1) if other != nodes)


@given(st.binary(max_size=2 * MAX_BYTES), st.integers(0, MAX_NODES))
def test_random_bytes_never_raise(data, nodes):
    decode(data, nodes)


@pytest.mark.parametrize(("place", "value"), [(0, 0xD6), (1, 2), (2, 5), (3, 4), (10, 0b1), (10, 0b100000)],
                         ids=["magic", "version", "sender", "nodes", "node 0 hears itself", "node 0 hears a sixth"])
def test_one_wrong_byte_in_the_known_fields_is_nothing(place, value):
    data = bytearray(DiscoveryFrame(1, 7, 9, (2, 4, 8, 16, 1)).encode())
    assert decode(bytes(data), 5) is not None

    data[place] = value

    assert decode(bytes(data), 5) is None


def test_sixteen_nodes_fit_a_payload_of_60_bytes_and_seventeen_do_not():
    assert frame_bytes(16) == 42
    assert MAX_NODES == 16
    assert frame_bytes(17) == 61 > MAX_BYTES
