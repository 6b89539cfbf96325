"""Worst-case response times: the paper's example, brute force over all phases, and the bus itself."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netem.media.can.encoded_frame import encode_frame
from netem.media.can.frame import CanFrame, pack
from netem.media.can.messages import CanMessage, periodic
from netem.media.can.response_time import PeriodicMessage, response_time_ns, utilization
from netem.media.can.settings import CanSettings
from tests.examples import examples
from tests.netem.media.can.can_bench import BIT, MS, CanBench

US = 1000


def test_the_three_messages_that_refuted_the_first_analysis() -> None:
    """Davis et al. 2007: 125 kbit/s, 125 bits each, periods 2.5, 3.5, 3.5 ms. Of the last one the first instance
    answers in 3 ms, which was held to be the worst; the second one takes 3.5 ms."""
    messages = [PeriodicMessage(name, MS, period_ns) for name, period_ns in
                (("A", 2500 * US), ("B", 3500 * US), ("C", 3500 * US))]

    assert [response_time_ns(messages, index, 8 * US) for index in range(3)] == [2 * MS, 3 * MS, 3500 * US]
    assert utilization(messages) == pytest.approx(0.4 + 2 / 3.5, rel=1e-12)


# --- brute force: a non-preemptive bus in whole units, all phases of all messages and of the frame that blocks

def observed(messages: list[PeriodicMessage], phases: tuple[int, ...], until: int) -> list[int]:
    """Largest response time of each message; one queued at the very instant of a start takes part in arbitration."""
    worst = [0] * len(messages)
    releases = [list(range(phase, until, message.period_ns)) for message, phase in zip(messages, phases, strict=True)]
    now = 0
    while any(releases):
        ready = [index for index, queue in enumerate(releases) if queue and queue[0] <= now]
        if not ready:
            now = min(queue[0] for queue in releases if queue)
            continue
        index = ready[0]
        released = releases[index].pop(0)
        now += messages[index].frame_ns
        worst[index] = max(worst[index], now - released)
    return worst


@settings(max_examples=examples(40), deadline=None)
@given(sets=st.lists(st.tuples(st.integers(1, 4), st.integers(6, 12)), min_size=2, max_size=3))
def test_some_phase_gives_the_bound_and_none_gives_more(sets: list[tuple[int, int]]) -> None:
    """In whole units, with arbitration among all that is queued by the instant of a start, the bit time of the analysis
    is one unit, and what blocks can start one unit ahead at the latest: it blocks one unit less. Then it is exact."""
    messages = [PeriodicMessage(str(index), frame, period) for index, (frame, period) in enumerate(sets)]
    worst = [0] * len(messages)

    for phases in product(*(range(message.period_ns) for message in messages)):
        worst = [max(pair) for pair in zip(worst, observed(messages, phases, 150), strict=True)]

    for index, seen in enumerate(worst):
        shorter = [replace(lower, frame_ns=lower.frame_ns - 1) for lower in messages[index + 1:] if lower.frame_ns > 1]
        bound = response_time_ns([*messages[:index + 1], *shorter], index, 1)
        assert bound is None or seen == bound
        assert seen <= (response_time_ns(messages, index, 1) or seen)


def sufficient(messages: list[PeriodicMessage], index: int) -> int | None:
    """Davis et al.: an upper bound by one fixed point with max(B, C_m) for B; None beyond the period."""
    own, higher = messages[index], messages[:index]
    start = wait = max(own.frame_ns, *(message.frame_ns for message in messages[index:]))
    while own.jitter_ns + wait + own.frame_ns <= own.period_ns:
        longer = start + sum(-(-(wait + 1 + k.jitter_ns) // k.period_ns) * k.frame_ns for k in higher)
        if longer == wait:
            return own.jitter_ns + wait + own.frame_ns
        wait = longer
    return None


@settings(max_examples=examples(100), deadline=None)
@given(sets=st.lists(st.tuples(st.integers(1, 30), st.integers(50, 400), st.integers(0, 40)), min_size=1, max_size=6))
def test_the_sufficient_test_never_says_less_than_the_exact_one(sets: list[tuple[int, int, int]]) -> None:
    messages = [PeriodicMessage(str(index), *one) for index, one in enumerate(sets)]

    for index in range(len(messages)):
        bound = sufficient(messages, index)
        exact = response_time_ns(messages, index, 1)
        assert bound is None or (exact is not None and bound >= exact)


def test_jitter_lets_two_instances_come_close_and_delays_ones_own() -> None:
    """By hand. b and a are queued at 0, that a late by its jitter of 4, so the next a comes at 2, the one after at 8:
    the bus carries a, a, b, until 10. The worst for a: b has just begun as it is queued, 4 late: 4 + 4 + 3."""
    messages = [PeriodicMessage("a", 3, 6, jitter_ns=4), PeriodicMessage("b", 4, 20)]

    assert [response_time_ns(messages, index, 1) for index in range(2)] == [11, 10]


def test_more_than_the_bus_carries_has_no_bound() -> None:
    messages = [PeriodicMessage("a", 6, 10), PeriodicMessage("b", 5, 10), PeriodicMessage("c", 1, 100)]

    assert response_time_ns(messages, 0, 1) == 11
    assert response_time_ns(messages, 1, 1) is None
    assert response_time_ns(messages, 2, 1) is None
    assert sufficient(messages, 1) is None


def test_a_bus_that_is_full_to_the_last_bit_has_a_bound_if_nothing_waits_besides() -> None:
    full = [PeriodicMessage("a", 5, 10), PeriodicMessage("b", 5, 10)]

    assert response_time_ns(full, 1, 1) == 10
    assert response_time_ns([*full[:1], PeriodicMessage("b", 5, 10, jitter_ns=1)], 1, 1) is None


# --- the bus itself

# A drive's messages at 500 kbit/s, about 60 % of the bus with the worst stuffing.
DRIVE = {
    "stop": CanMessage(0x010, 20 * MS, "a", 1), "setpoint": CanMessage(0x078, 2 * MS, "b", 8),
    "left": CanMessage(0x0F4, 2 * MS, "a", 8), "right": CanMessage(0x0CC, 2500 * US, "c", 8),
    "imu": CanMessage(0x07B, 4 * MS, "c", 8), "odometry": CanMessage(0x1F4, 5 * MS, "a", 8),
    "battery": CanMessage(0x7F0, 10 * MS, "b", 8), "log": CanMessage(0x12345 << 10, 10 * MS, "c", 8, extended=True),
}

# The same drive with CAN FD at 2 Mbit/s beside classical frames.
FAST = DRIVE | {
    "imu": CanMessage(0x07B, 2 * MS, "c", 48, fd=True), "odometry": CanMessage(0x1F4, 2 * MS, "a", 32, fd=True),
    "log": CanMessage(0x12345 << 10, 5 * MS, "c", 64, extended=True, fd=True),
    "battery": CanMessage(0x7F0, 10 * MS, "b", 12, fd=True, bit_rate_switch=False),
}
FD_BPS = 2_000_000
BOTH = pytest.mark.parametrize("messages", [DRIVE, FAST], ids=["classical", "with CAN FD"])


def bounds_ns(messages: dict[str, CanMessage]) -> dict[str, int]:
    found = periodic(messages, CanSettings(500_000, FD_BPS).clock)
    return {message.name: response_time_ns(found, index, BIT) or 0 for index, message in enumerate(found)}


@BOTH
def test_nothing_observed_is_above_the_bound_at_random_phases_and_data(messages: dict[str, CanMessage]) -> None:
    rng = Random("phases")
    bounds = bounds_ns(messages)

    for _ in range(12):
        phases = {name: rng.randrange(message.period_ns) for name, message in messages.items()}
        data = {name: rng.randbytes(message.length_bytes) for name, message in messages.items()}
        found = responses_of(messages, phases, data, 200 * MS)
        assert all(found[name] <= bounds[name] for name in messages)
        assert min(found.values()) > 0


@BOTH
def test_a_constructed_worst_case_reaches_the_bound_within_a_tenth(messages: dict[str, CanMessage]) -> None:
    """The critical instant of each message: all of higher priority are queued with it, just after the longest of lower
    priority has started, and all data is stuffed as badly as found."""
    bounds = bounds_ns(messages)
    worst_data = {name: worst_payload(message) for name, message in messages.items()}
    order = [message.name for message in periodic(messages, CanSettings(500_000, FD_BPS).clock)]

    for place, name in enumerate(order):
        phases = dict.fromkeys(order, BIT)
        lower = order[place + 1:]
        if lower:
            blocker = max(lower, key=lambda other: length_ns(messages[other], worst_data[other]))
            phases |= dict.fromkeys(lower, 10 * MS) | {blocker: 0}
        found = responses_of(messages, phases, worst_data, 9 * MS)
        assert 0.9 * bounds[name] <= found[name] <= bounds[name]


def frame_of(message: CanMessage, data: bytes) -> CanFrame:
    return CanFrame(message.id, data, message.extended, fd=message.fd,
                    bit_rate_switch=message.fd and message.bit_rate_switch)


def length_ns(message: CanMessage, data: bytes) -> int:
    length = encode_frame(pack(frame_of(message, data)))
    return length.nominal_bits * BIT + length.data_bits * 10**9 // FD_BPS


def worst_payload(message: CanMessage) -> bytes:
    """Of the rotations of 0x0F0F.., which stuff at every fourth bit."""
    rotations = (bytes([(0x0F0F >> turn) & 0xFF] * message.length_bytes) for turn in range(8))
    return max(rotations, key=lambda data: length_ns(message, data))


def responses_of(messages: dict[str, CanMessage], phases_ns: dict[str, int], data: dict[str, bytes],
                 end_ns: int) -> dict[str, int]:
    """Largest time from handing out to the end of the intermission, of each message."""
    bench = CanBench("abcd", queue_frames=100, messages=messages, end_ns=end_ns + 50 * MS, data_bit_rate_bps=FD_BPS)
    numbers: dict[tuple[str, int], str] = {}
    counts = dict.fromkeys("abc", 0)
    offers = sorted((at_ns, message.sender, key) for key, message in messages.items()
                    for at_ns in range(phases_ns[key], end_ns, message.period_ns))
    for at_ns, sender, name in offers:
        bench.offer(at_ns, sender, frame_of(messages[name], data[name]))
        numbers[sender, counts[sender]] = name
        counts[sender] += 1
    worst = dict.fromkeys(messages, 0)
    for row in bench.run().rows(receiver="d"):
        name = numbers[row["sender"], row["number"]]
        worst[name] = max(worst[name], row["end_ns"] + 3 * BIT - row["offered_ns"])
    return worst
