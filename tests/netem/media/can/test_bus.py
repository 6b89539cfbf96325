"""What a bus does with frames that nothing goes wrong with: when they are on it, in which order, who gets them."""

import pytest

from netem.core.fate import Fate
from netem.media.can.frame import CanFrame, pack, unpack
from netem.media.can.messages import CanMessage
from tests.netem.media.can.bit_by_bit import encode
from tests.netem.media.can.can_bench import BIT, MS, US, CanBench

NO_DATA = CanFrame(0x100)
EIGHT = CanFrame(0x100, b"12345678")


def bits(frame: CanFrame) -> int:
    return len(encode(frame))


def order(bench: CanBench, receiver: str = "c") -> list[int]:
    return [unpack(data).can_id for _, name, data in bench.arrivals if name == receiver]


def test_receivers_take_a_frame_one_bit_before_its_end_and_it_starts_when_it_is_handed_out() -> None:
    bench = CanBench().run((17, "a", EIGHT))

    end_ns = 17 + bits(EIGHT) * BIT
    assert bench.arrivals == [(end_ns - BIT, "b", pack(EIGHT)), (end_ns - BIT, "c", pack(EIGHT))]
    assert [(row["offered_ns"], row["on_air_ns"], row["end_ns"], row["delivered_ns"]) for row in bench.rows()] == [
        (17, 17, end_ns, end_ns - BIT)] * 2


def test_the_next_frame_starts_three_bits_after_the_end_of_the_last() -> None:
    bench = CanBench().run((0, "a", EIGHT), (5, "b", NO_DATA))

    first, second = bench.rows(receiver="c")
    assert second["on_air_ns"] == first["end_ns"] + 3 * BIT


def test_a_frame_handed_out_in_the_intermission_waits_for_its_end() -> None:
    end_ns = bits(EIGHT) * BIT

    bench = CanBench().run((0, "a", EIGHT), (end_ns + 2 * BIT, "b", NO_DATA), (end_ns + 90 * BIT, "c", NO_DATA))

    assert [row["on_air_ns"] for row in bench.rows("b", "a")] == [end_ns + 3 * BIT]
    assert [row["on_air_ns"] for row in bench.rows("c", "a")] == [end_ns + 90 * BIT]


def test_who_waits_at_one_instant_goes_by_identifier_whatever_the_order_of_names() -> None:
    bench = CanBench("abcd").run((0, "d", EIGHT), *((1 + k, name, CanFrame(can_id)) for k, (name, can_id) in
                                                 enumerate([("a", 0x300), ("b", 0x100), ("d", 0x200)])))

    assert order(bench) == [0x100, 0x100, 0x200, 0x300]


def test_frames_handed_out_at_the_very_start_contend_too() -> None:
    bench = CanBench("abcd").run((0, "a", CanFrame(0x300)), (0, "b", CanFrame(0x200)), (0, "d", CanFrame(0x100)))

    assert order(bench) == [0x100, 0x200, 0x300]


def test_a_frame_is_not_interrupted_by_one_of_higher_priority() -> None:
    bench = CanBench().run((0, "a", CanFrame(0x700, bytes(8))), (1, "b", CanFrame(0)))

    assert order(bench) == [0x700, 0]
    assert bench.rows("a", "c")[0]["end_ns"] == bits(CanFrame(0x700, bytes(8))) * BIT


def test_standard_beats_extended_and_data_beats_remote_on_the_bus() -> None:
    base = 0x155
    kinds = [CanFrame(base), CanFrame(base, remote=True), CanFrame(base << 18, extended=True),
             CanFrame(base << 18, extended=True, remote=True), CanFrame((base << 18) + 1, extended=True)]

    bench = CanBench("abcdez").run((0, "z", EIGHT), *((1, name, frame) for name, frame in
                                                    zip("abcde", reversed(kinds), strict=True)))

    heard = [unpack(data) for _, name, data in bench.arrivals if name == "z"]
    assert [(frame.can_id, frame.extended, frame.remote) for frame in heard] == [
        (frame.can_id, frame.extended, frame.remote) for frame in kinds]


# --- queues

BLOCKER = (0, "b", CanFrame(0x7F0, bytes(8)))


def queued(*can_ids: int) -> list[tuple[int, str, CanFrame]]:
    return [(1 + k, "a", CanFrame(can_id, bytes((k,)))) for k, can_id in enumerate(can_ids)]


def test_a_priority_queue_sends_the_lowest_identifier_first_and_one_identifier_in_order() -> None:
    bench = CanBench().run(BLOCKER, *queued(0x300, 0x100, 0x200, 0x100))

    assert order(bench)[1:] == [0x100, 0x100, 0x200, 0x300]
    assert [unpack(data).data[0] for _, name, data in bench.arrivals if name == "c"][1:] == [1, 3, 2, 0]


def test_a_fifo_lets_a_high_identifier_keep_a_low_one_waiting() -> None:
    bench = CanBench(queue="fifo").run(BLOCKER, *queued(0x300, 0x100), (3, "c", CanFrame(0x200)))

    assert order(bench, "b") == [0x200, 0x300, 0x100]


def test_a_mailbox_holds_the_newest_frame_of_its_identifier() -> None:
    bench = CanBench(queue="mailbox").run(BLOCKER, *queued(0x300, 0x100, 0x300))

    assert [unpack(data).data for _, name, data in bench.arrivals if name == "c"][1:] == [b"\1", b"\2"]
    assert bench.fates("a", "c") == [Fate.QUEUE_FULL, Fate.DELIVERED, Fate.DELIVERED]
    assert bench.rows("a", "c")[0]["cause"] == "a newer frame took its mailbox"


def test_a_frame_on_the_bus_has_left_its_mailbox() -> None:
    bench = CanBench(queue="mailbox").run((0, "a", CanFrame(0x300, b"old")), (1, "a", CanFrame(0x300, b"new")))

    assert [unpack(data).data for _, name, data in bench.arrivals if name == "c"] == [b"old", b"new"]


@pytest.mark.parametrize("queue", ["priority", "fifo", "mailbox"])
def test_what_does_not_fit_into_the_queue_is_counted_and_has_a_fate(queue: str) -> None:
    bench = CanBench(queue=queue, queue_frames=2).run(BLOCKER, *queued(0x100, 0x200, 0x300))

    assert bench.fates("a", "c") == [Fate.DELIVERED, Fate.DELIVERED, Fate.QUEUE_FULL]
    assert bench.bus.counters()["a"]["can.queue_full"] == 1


# --- what nodes hand out and get

def test_a_node_hears_its_own_frame_at_its_end_only_if_asked_for() -> None:
    bench = CanBench(own_frames_to=("a",)).run((0, "a", EIGHT), (1 * MS, "b", EIGHT))

    end_ns = bits(EIGHT) * BIT
    assert [(at_ns, name) for at_ns, name, _ in bench.arrivals] == [
        (end_ns - BIT, "b"), (end_ns - BIT, "c"), (end_ns, "a"), (MS + end_ns - BIT, "a"), (MS + end_ns - BIT, "c")]


@pytest.mark.parametrize("data", [b"", b"nonsense", bytes(73), pack(CanFrame(0x123))[:-1],
                                  pack(CanFrame(4, bytes(8), error=True)), pack(CanFrame(1, fd=True))])
def test_a_malformed_frame_is_counted_told_and_ends_malformed(data: bytes) -> None:
    bench = CanBench().run((5, "a", data), (6, "a", data), (7, "b", EIGHT))

    assert bench.fates("a", "c") == [Fate.MALFORMED, Fate.MALFORMED]
    assert all(row["cause"] for row in bench.rows("a"))
    assert bench.bus.counters()["a"]["can.malformed"] == 2
    assert [(time_ns, node, kind) for time_ns, node, kind, _ in bench.events] == [(5, "a", "malformed CAN frame")]
    assert bench.fates("b", "c") == [Fate.DELIVERED]


def test_can_fd_needs_the_second_bit_rate_and_takes_it_for_the_bits_between() -> None:
    frame = CanFrame(0x123, bytes(range(64)), fd=True, bit_rate_switch=True)
    fast = sum(bit.fast for bit in encode(frame))
    slow = bits(frame) - fast

    bench = CanBench(data_bit_rate_bps=4_000_000).run((0, "a", frame), (1, "b", EIGHT))

    rows = bench.rows(receiver="c")
    assert rows[0]["end_ns"] == slow * 2_000 + fast * 250
    assert rows[1]["on_air_ns"] == rows[0]["end_ns"] + 3 * BIT


def test_a_can_fd_frame_of_a_declared_length_that_no_dlc_names_is_malformed() -> None:
    data = bytearray(pack(CanFrame(1, bytes(12), fd=True)))
    data[4] = 11

    bench = CanBench(data_bit_rate_bps=2_000_000).run((0, "a", bytes(data)))

    assert bench.fates("a", "b") == [Fate.MALFORMED]


def test_with_messages_only_whatever_is_not_declared_is_malformed() -> None:
    bench = CanBench(messages={"one": CanMessage(0x100, 10 * MS, "a", 8)}, messages_only=True)

    bench.run((0, "a", EIGHT), (1, "a", CanFrame(0x101, bytes(8))), (2, "a", NO_DATA), (3, "b", EIGHT))

    assert bench.fates("a", "c") == [Fate.DELIVERED, Fate.MALFORMED, Fate.MALFORMED]
    assert bench.fates("b", "c") == [Fate.MALFORMED]


def test_what_waits_at_the_end_and_what_is_on_the_bus_is_unfinished() -> None:
    bench = CanBench(end_ns=100 * US).run((0, "a", EIGHT), (1, "b", NO_DATA), (2, "b", NO_DATA))

    assert {(row["sender"], row["fate"], row["cause"]) for row in bench.rows()} == {
        ("a", "unfinished", "under way"), ("b", "unfinished", "waiting")}


# --- load

def test_load_is_the_share_of_each_window_that_frames_and_intermissions_take() -> None:
    frame_ns = (bits(EIGHT) + 3) * BIT                          # some 230 us
    bench = CanBench(load_window_ns=MS, end_ns=4 * MS)

    bench.run((0, "a", EIGHT), (100, "b", EIGHT), (MS - 1000, "a", EIGHT), (3 * MS, "a", NO_DATA))

    busy_ns = [2 * frame_ns + 1000, frame_ns - 1000, 0, (bits(NO_DATA) + 3) * BIT]
    assert bench.loads == [((k + 1) * MS, pytest.approx(ns / MS, rel=1e-12)) for k, ns in enumerate(busy_ns)]
    assert bench.bus.counters()["can"]["busy_us"] == sum(busy_ns) // 1000


def test_a_bus_that_is_never_idle_has_a_load_of_one() -> None:
    bench = CanBench(queue_frames=400, load_window_ns=MS, end_ns=50 * MS)

    bench.run(*((0, "a", EIGHT) for _ in range(400)))

    assert [load for _, load in bench.loads] == [1.0] * 50
