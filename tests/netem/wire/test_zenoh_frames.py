"""Zenoh messages as frames: back unchanged, no longer than the medium allows, and no bytes that raise anything else."""

from __future__ import annotations

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netem.wire.zenoh_codec import decode, encode
from netem.wire.zenoh_frames import ADDRESS_BYTES, EVERYONE, LEAST_ROOM, SN_MASK, ZenohReceiver, ZenohSender
from netem.wire.zenoh_messages import (
    ENCODINGS,
    Data,
    Declare,
    Entity,
    Interest,
    MalformedZenohFrame,
    Message,
    Push,
    Qos,
    Request,
    Response,
    ResponseFinal,
    Stamp,
    Undeclare,
)

NUMBERS = st.integers(0, 2**32 - 1)
KEYS = st.text(st.characters(blacklist_categories=("Cs",)), min_size=1, max_size=40)
BYTES = st.binary(max_size=300)
QOS = st.builds(Qos, st.integers(1, 7), st.booleans(), st.booleans())
ENCODED = st.one_of(st.sampled_from(ENCODINGS), st.sampled_from(ENCODINGS).map(lambda name: name + ";schema"),
                    st.just("my/own"), st.just("my/own;of mine"))
STAMPS = st.none() | st.builds(Stamp, st.integers(0, 2**64 - 1), st.binary(min_size=1, max_size=16))
PUTS = st.builds(Data, BYTES, ENCODED, st.none() | BYTES, STAMPS)
DELETES = st.builds(Data, attachment=st.none() | BYTES, stamp=STAMPS, deletes=st.just(True))
SESSIONS = st.binary(min_size=1, max_size=16)
MESSAGES = st.one_of(
    st.builds(Push, KEYS, PUTS | DELETES, QOS),
    st.builds(Request, NUMBERS, KEYS, st.text(max_size=20).filter(lambda text: "\ud800" not in text),
              st.integers(0, 2), st.integers(0, 3), st.integers(0, 2**40), st.none(), st.just(ENCODINGS[0]),
              st.none() | BYTES, QOS),
    st.builds(Request, NUMBERS, KEYS, payload=BYTES, encoding=ENCODED),
    st.builds(Response, NUMBERS, KEYS, PUTS | DELETES, SESSIONS, NUMBERS, st.just(False), QOS),
    st.builds(Response, NUMBERS, KEYS, st.builds(Data, BYTES, ENCODED), SESSIONS, NUMBERS, st.just(True)),
    st.builds(ResponseFinal, NUMBERS, QOS),
    st.builds(Declare, st.sampled_from([Entity.SUBSCRIBER, Entity.TOKEN]), NUMBERS, KEYS),
    st.builds(Declare, st.just(Entity.QUERYABLE), NUMBERS, KEYS, st.booleans()),
    st.builds(Undeclare, st.sampled_from(Entity), NUMBERS),
    st.builds(Interest, NUMBERS))


def heard(frames: list[bytes]) -> list[Message]:
    receiver = ZenohReceiver()
    return [message for frame in frames for message in receiver.take(frame).messages]


@given(st.lists(MESSAGES, max_size=6), st.none() | st.integers(LEAST_ROOM, 400))
def test_messages_come_back_from_frames_that_fit_the_medium(messages: list[Message], longest: int | None) -> None:
    frames = ZenohSender(7, longest).frames(messages)

    assert heard(frames) == messages
    assert longest is None or max(map(len, frames), default=0) <= longest


@given(MESSAGES)
def test_a_cut_message_is_malformed(message: Message) -> None:
    data = encode(message)

    for end in range(1, len(data)):
        with pytest.raises(MalformedZenohFrame):
            decode(data[:end])


@given(st.binary(max_size=60))
def test_no_bytes_raise_anything_else(garbage: bytes) -> None:
    for data in (garbage, b"\xff\xff\1\0\x25\x80\x80\x80\1" + garbage):
        try:
            ZenohReceiver().take(data)
        except MalformedZenohFrame:
            continue


def test_damaged_frames_raise_nothing_else() -> None:
    rng = Random("damaged frames")
    sender = ZenohSender(3, 60)
    whole = sender.frames([Push("a/b", Data(bytes(200), "text/plain", b"x", Stamp(2**63, b"id"))),
                           Request(1, "a/**", "x=1", payload=b"p"), Declare(Entity.TOKEN, 4, "live/a")])
    receiver, malformed = ZenohReceiver(), 0
    for _ in range(20_000):
        damaged = bytearray(rng.choice(whole))
        for _ in range(rng.randrange(1, 4)):
            damaged[rng.randrange(len(damaged))] = rng.randrange(256)
        try:
            receiver.take(bytes(damaged))
        except MalformedZenohFrame:
            malformed += 1

    assert malformed > 100


def test_addresses_stand_first() -> None:
    (frame,) = ZenohSender(0x0102, None).frames([Interest(1)], to=0x0304)

    batch = ZenohReceiver().take(frame)

    assert (batch.sender, batch.receiver, frame[:ADDRESS_BYTES]) == (0x0102, 0x0304, b"\4\3\2\1")


def test_small_messages_of_one_priority_share_a_frame() -> None:
    tokens = [Declare(Entity.TOKEN, number, f"live/{number}") for number in range(3)]

    frames = ZenohSender(1, None).frames([*tokens, Push("a", Data(b"x")), Push("a", Data(b"y"))])

    assert len(frames) == 2
    assert len(frames[0]) == 4 + 5 + 2 + sum(len(encode(token)) for token in tokens)


def test_a_message_without_one_of_its_fragments_is_lost_and_counted_and_the_next_arrives() -> None:
    sender, receiver = ZenohSender(1, 60), ZenohReceiver()
    long, short = Push("a", Data(bytes(200))), Push("a", Data(b"short"))
    frames = sender.frames([long])
    assert len(frames) == 5             # 206 bytes of message in pieces of 50 and 51

    got = [message for frame in [*frames[:2], *frames[3:], *sender.frames([short])]
           for message in receiver.take(frame).messages]

    assert got == [short]
    assert receiver.incomplete == 1


def test_a_repeated_frame_is_dropped_and_the_next_life_of_a_node_is_heard() -> None:
    receiver = ZenohReceiver()
    (frame,) = ZenohSender(1, None, first_number=SN_MASK).frames([Interest(1)])
    (next_life,) = ZenohSender(1, None, first_number=SN_MASK // 2).frames([Interest(2)])

    counts = [len(receiver.take(frame).messages) for frame in (frame, frame, next_life)]

    assert counts == [1, 0, 1]
    assert receiver.late == 1


def test_sequence_numbers_wrap() -> None:
    sender = ZenohSender(1, None, first_number=SN_MASK)

    assert len(heard(sender.frames([Interest(1)]) + sender.frames([Interest(2)]))) == 2


@pytest.mark.parametrize("make", [lambda: ZenohSender(EVERYONE, None), lambda: ZenohSender(1, LEAST_ROOM - 1)])
def test_a_sender_refuses_nonsense(make) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ValueError, match=r"expected|at least"):
        make()
