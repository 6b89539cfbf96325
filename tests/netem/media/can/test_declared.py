"""What is declared against what happens: each difference is told once, and frames as declared are never told of."""

from __future__ import annotations

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netem.core.fate import Fate
from netem.media.can.declared import CLOCK_TOLERANCE, MOST_TOLD, VOID, DeclarationWatch
from netem.media.can.encoded_frame import encode_frame
from netem.media.can.frame import CanFrame, pack
from netem.media.can.messages import CanMessage
from tests.netem.media.can.can_bench import MS, CanBench

EIGHT = CanFrame(0x100, bytes(8))
FD = CanFrame(0x200, bytes(64), fd=True, bit_rate_switch=True)
MESSAGES = {"front": CanMessage(0x100, 10 * MS, "a", 8),
            "rear": CanMessage(0x200, 20 * MS, "b", 64, fd=True)}


def told(*offers: tuple[int, str, CanFrame]) -> list[tuple[int, str, str]]:
    bench = CanBench(messages=MESSAGES, data_bit_rate_bps=2_000_000).run(*offers)
    return [(at_ns, node, words.removeprefix("can: ")) for at_ns, node, kind, words in bench.events
            if kind == "not as declared"]


def test_frames_as_declared_are_not_told_of() -> None:
    assert told(*((k * 10 * MS, "a", EIGHT) for k in range(20)), *((k * 20 * MS + 1, "b", FD) for k in range(10))) == []


@pytest.mark.parametrize(("sender", "frame", "says"), [
    ("b", CanFrame(0x200, bytes(64), fd=True),
     f"0x200: rear: without bit rate switch, declared with bit rate switch; {VOID}"),
    ("b", CanFrame(0x200, bytes(8)), f"0x200: rear: classical CAN, declared as CAN FD; {VOID}"),
    ("a", CanFrame(0x100, bytes(8), fd=True), f"0x100: front: CAN FD, declared as classical CAN; {VOID}"),
    ("a", CanFrame(0x100, bytes(7)), "0x100: front: 7 bytes, declared with 8"),
    ("c", EIGHT, f"0x100: front: declared for a; {VOID}"),
    ("a", CanFrame(0x101, b"x"), f"0x101: hands out a message that is not declared; {VOID}"),
])
def test_a_frame_that_is_not_as_declared_is_told_once(sender: str, frame: CanFrame, says: str) -> None:
    found = told(*((k * 20 * MS, sender, frame) for k in range(5)))

    assert (0, sender, says) in found
    assert len({words for _, _, words in found}) == len(found)


def test_a_message_that_comes_more_often_than_declared_is_told_with_its_distance() -> None:
    assert told(*((k * 7 * MS, "a", EIGHT) for k in range(5))) == [
        (7 * MS, "a", f"0x100: front: 7 ms after the one before, declared period 10 ms, jitter 0 ms; {VOID}")]


def test_with_messages_only_a_frame_without_the_declared_bit_rate_switch_is_malformed() -> None:
    bench = CanBench(messages=MESSAGES, data_bit_rate_bps=2_000_000, messages_only=True)

    bench.run((0, "b", FD), (20 * MS, "b", CanFrame(0x200, bytes(64), fd=True)))

    assert bench.fates("b", "a") == [Fate.DELIVERED, Fate.MALFORMED]


def watched(period_ns: int, jitter_ns: int, at_ns: list[int]) -> list[int]:
    """The numbers of the frames that are told of, handed out at these instants by a sender of one message."""
    watch = DeclarationWatch({"front": CanMessage(0x100, period_ns, "a", 8, jitter_ns=jitter_ns)})
    length = encode_frame(pack(EIGHT))
    return [number for number, time_ns in enumerate(at_ns) if watch.look("a", length, time_ns)]


@given(st.integers(1_000, 10**8), st.integers(0, 10**7), st.integers(1, 60), st.integers(0, 2**32))
def test_a_period_with_its_jitter_and_a_clock_within_the_tolerance_conforms(
        period_ns: int, jitter_ns: int, count: int, seed: int) -> None:
    rng, step_ns = Random(seed), period_ns - int(period_ns * CLOCK_TOLERANCE)

    queued_ns = sorted(k * step_ns + rng.randint(0, jitter_ns) for k in range(count))

    assert watched(period_ns, jitter_ns, queued_ns) == []


@given(st.integers(1_000, 10**8), st.integers(0, 1_000), st.integers(1, 500))
def test_a_message_that_comes_too_fast_is_told_of_once_its_lead_exceeds_the_jitter(
        period_ns: int, jitter_ns: int, faster_ns: int) -> None:
    step_ns = round(period_ns * (1 - CLOCK_TOLERANCE)) - faster_ns
    first = jitter_ns // faster_ns + 1          # the k-th frame leads by k faster_ns

    found = watched(period_ns, jitter_ns, [k * step_ns for k in range(first + 5)])

    assert found == [first]


def test_a_flood_of_undeclared_identifiers_leaves_a_bounded_number_of_events() -> None:
    watch = DeclarationWatch(MESSAGES)

    found = [words for can_id in range(0x300, 0x300 + 3 * MOST_TOLD)
             for words in watch.look("c", encode_frame(pack(CanFrame(can_id))), can_id)]

    assert len(found) == MOST_TOLD
