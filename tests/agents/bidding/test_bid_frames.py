"""Messages to bytes and back; bytes from the air never raise."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.bidding.bid_frames import (
    NO_BID,
    PER_TASK_BYTES,
    Award,
    Bid,
    Detection,
    Flooded,
    GreatestBid,
    ModeMessage,
    Standing,
    Task,
    as_sent,
    flooding_frame_bytes,
    frame_bytes,
    head,
    newer,
    pack,
    unpack,
)

SENSORS = 5
small, number = st.integers(0, 255), st.floats(width=32, allow_nan=False, allow_infinity=False)
tasks = st.builds(Task, small, small)
sensor, word = st.integers(0, SENSORS - 1), st.integers(0, 2**32 - 1)
passed_on = st.one_of(
    st.builds(Detection, small, small, st.integers(-2**63, 2**63 - 1), number, number),
    st.builds(Award, tasks, small, sensor, number),
    st.builds(ModeMessage, small, st.sampled_from(Standing), tasks, small, number, number, number))
messages = st.one_of(
    passed_on,
    st.builds(Bid, tasks, small, word, number | st.just(NO_BID)),
    st.builds(GreatestBid, tasks, small, sensor, word, number | st.just(NO_BID)),
    st.builds(Flooded, sensor, word, passed_on))


@given(st.integers(0, SENSORS - 1), st.lists(messages, max_size=6))
def test_a_frame_reads_back_as_it_was_written(sender, sent):
    data = head(sender) + b"".join(map(pack, sent))

    assert unpack(data, SENSORS) == (sender, sent)


@given(st.binary(max_size=60) | st.builds(lambda rest: b"\xb1\x01" + rest, st.binary(max_size=60)))
def test_other_bytes_are_none_or_well_formed(data):
    found = unpack(data, SENSORS)

    assert found is None or head(found[0]) + b"".join(map(pack, found[1])) == data


def test_the_bytes_are_those_that_the_layout_says():
    assert head(3) == b"\xb1\x03"
    assert pack(Bid(Task(1, 2), 3, 0x0A0B, 1.0)) == b"B\x01\x02\x03\x0b\x0a\x00\x00\x00\x00\x80\x3f"
    assert pack(Award(Task(1, 2), 3, 4, -2.0)) == b"A\x01\x02\x03\x04\x00\x00\x00\xc0"
    assert pack(ModeMessage(7, Standing.LET_GO, Task(1, 2), 3, 1.0, 0.0, 2.0)) == (
        b"M\x07\x02\x01\x02\x03\x00\x00\x80\x3f\x00\x00\x00\x00\x00\x00\x00\x40")
    assert pack(Detection(1, 2, 256, 1.0, -2.0)) == b"D\x01\x02\x00\x01\0\0\0\0\0\0\x00\x00\x80\x3f\x00\x00\x00\xc0"
    assert pack(GreatestBid(Task(1, 2), 3, 4, 0x0A0B, 1.0)) == b"G\x01\x02\x03\x04\x0b\x0a\x00\x00\x00\x00\x80\x3f"
    assert pack(Flooded(2, 0x0A0B, Award(Task(1, 2), 3, 4, -2.0))) == (
        b"R\x02\x0b\x0a\x00\x00A\x01\x02\x03\x04\x00\x00\x00\xc0")
    assert PER_TASK_BYTES == 19 + 12 + 18
    assert frame_bytes(3) == 2 + 18 + 3 * 49
    assert flooding_frame_bytes(3, 5) == 2 + 5 * 24 + 3 * (5 * 25 + 13 + 3 * 24)


@pytest.mark.parametrize("data", [
    b"", b"\xb1", b"\xb2\x00", b"\xb1\x05",                                         # no head, not of this team
    b"\xb1\x00X", b"\xb1\x00" + pack(Award(Task(0, 0), 0, 0, 1.0))[:-1],           # an unknown kind; cut
    b"\xb1\x00" + pack(Award(Task(0, 0), 0, 5, 1.0)),                              # a winner that there is not
    b"\xb1\x00" + struct.pack("<cBBBIf", b"B", 0, 0, 0, 0, float("nan")),
    b"\xb1\x00" + struct.pack("<cBBBIf", b"B", 0, 0, 0, 0, float("inf")),           # would win always
    b"\xb1\x00" + struct.pack("<cBBBBf", b"A", 0, 0, 0, 0, NO_BID),
    b"\xb1\x00" + struct.pack("<cBBBBBfff", b"M", 0, 5, 0, 0, 0, 0.0, 0.0, 0.0),    # a standing that there is not
    b"\xb1\x00" + pack(GreatestBid(Task(0, 0), 0, 5, 0, 1.0)),                       # a bidder that there is not
    b"\xb1\x00" + pack(Flooded(5, 0, Award(Task(0, 0), 0, 0, 1.0))),                 # an origin that there is not
    b"\xb1\x00R\x01\0\0\0\0",                                                       # nothing that is flooded
    b"\xb1\x00R\x01\0\0\0\0R\x01\0\0\0\0" + pack(Award(Task(0, 0), 0, 0, 1.0)),
    b"\xb1\x00R\x01\0\0\0\0" + pack(Bid(Task(0, 0), 0, 0, 1.0)),                    # a bid is not
])
def test_a_frame_with_a_wrong_part_is_dropped_whole(data):
    assert unpack(data, SENSORS) is None


def test_epochs_are_compared_modulo_256():
    assert [newer(*pair) for pair in [(1, 0), (0, 255), (127, 0), (0, 0), (0, 1), (128, 0)]] == [True] * 3 + [False] * 3


@pytest.mark.parametrize("reward", [float("nan"), float("inf"), -float("inf"), 1e39])
def test_a_reward_that_no_frame_carries_is_refused(reward):
    with pytest.raises(ValueError, match="expected a finite number"):
        as_sent(reward)


def test_own_rewards_are_compared_as_the_others_hear_them():
    assert as_sent(0.1) != 0.1
    assert as_sent(as_sent(0.1)) == as_sent(0.1)
