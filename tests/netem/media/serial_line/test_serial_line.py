"""A serial line against closed forms and against a byte-by-byte simulation in exact fractions."""

from fractions import Fraction
from functools import partial
from math import ceil
from random import Random

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from netem.core.agenda import OFFER, Agenda
from netem.core.fate import Fate
from netem.impairments.scripted_loss import ScriptedLoss
from netem.media.links import Links
from netem.media.serial_line.serial_line import SerialLine
from netem.media.serial_line.settings import SerialLineSettings
from netem.records.ledger import COLUMNS, Ledger

END_NS = 10**12
US = 1_000                           # a byte of 8N1 at 10 Mbit/s


class Bench:
    def __init__(self, pipelines=None, end_ns=END_NS, **settings):
        self.agenda, self.ledger, self.heard, self.bounds_ns = Agenda(), Ledger(), [], []
        self.end_ns = end_ns
        self.line = SerialLine("uart", SerialLineSettings(**{"baud_bps": 10_000_000, **settings}), ("fc", "modem"),
                               self.agenda, self.ledger, Links(self.ledger, self._deliver, pipelines or {}),
                               lambda place: Random(place))

    def _deliver(self, receiver, medium, arrival_ns, data):
        assert all(arrival_ns >= bound_ns for bound_ns in self.bounds_ns)
        if arrival_ns < self.end_ns:
            self.heard.append((arrival_ns, receiver, data))

    def offer(self, at_ns, sender, data):
        def act():
            self.bounds_ns = [self.line.lookahead_ns(at_ns)]
            self.line.offer(sender, data, at_ns)
        self.agenda.at(at_ns, OFFER, sender, act)

    def run(self):
        self.agenda.run_before(self.end_ns)
        self.line.finish(self.end_ns)
        self.ledger.finish(end_ns=self.end_ns)
        return self

    def rows(self):
        return [dict(zip(COLUMNS, row, strict=True)) for row in self.ledger.rows]

    def fates(self):
        return [Fate(row["fate"]) for row in self.rows()]


@pytest.mark.parametrize(("settings", "bits"), [
    ({}, 10), ({"data_bits": 7}, 9), ({"parity": "even"}, 11), ({"stop_bits": 2, "parity": "odd"}, 12)])
def test_a_write_arrives_when_the_last_bit_of_its_last_byte_is_over(settings, bits):
    bench = Bench(baud_bps=57_600, **settings)
    bench.offer(5 * US, "fc", bytes(21))

    bench.run()

    assert bench.heard == [(5 * US + ceil(21 * bits * Fraction(10**9, 57_600)), "modem", bytes(21))]


def test_writes_of_one_end_follow_each_other_without_a_gap_and_the_other_end_does_not_wait():
    bench = Bench()
    bench.offer(0, "fc", b"ten bytes.")
    bench.offer(3 * US, "fc", b"ab")
    bench.offer(3 * US, "modem", b"x")

    bench.run()

    assert sorted(bench.heard) == [(4 * US, "fc", b"x"), (10 * US, "modem", b"ten bytes."), (12 * US, "modem", b"ab")]


def test_a_chunk_arrives_with_its_last_byte():
    bench = Bench(chunk_bytes=4, receive_latency_ns=7)
    bench.offer(0, "fc", b"0123456789")

    bench.run()

    assert bench.heard == [(4 * US + 7, "modem", b"0123"), (8 * US + 7, "modem", b"4567"),
                           (10 * US + 7, "modem", b"89")]
    assert [(row["on_air_ns"], row["end_ns"]) for row in bench.rows()] == [
        (0, 4 * US), (4 * US, 8 * US), (8 * US, 10 * US)]


def test_what_the_buffer_has_no_room_for_is_refused_as_a_whole_and_counted():
    bench = Bench(buffer_bytes=8)
    bench.offer(0, "fc", bytes(9))              # one byte begins at once, eight wait
    bench.offer(1 * US - 1, "fc", b"a")         # still eight
    bench.offer(1 * US, "fc", b"b")             # the second byte has just begun

    bench.run()

    assert sorted(bench.fates(), key=str) == sorted([Fate.DELIVERED, Fate.QUEUE_FULL, Fate.DELIVERED], key=str)
    assert bench.heard[-1] == (10 * US, "modem", b"b")
    assert bench.line.counters() == {"fc": {"uart bytes sent": 10, "uart bytes refused": 1},
                                     "modem": {"uart bytes sent": 0, "uart bytes refused": 0}}


def test_bits_that_are_not_on_the_line_do_not_arrive():
    bench = Bench(data_bits=7)
    bench.offer(0, "fc", b"\x00\x7f\x80\xff")

    bench.run()

    assert bench.heard[0][2] == b"\x00\x7f\x00\x7f"


def test_an_impairment_acts_on_chunks_and_the_run_may_end_before_a_byte_does():
    bench = Bench({("uart", "fc", "modem"): [("loss", ScriptedLoss(lose_frames=[1]))]}, end_ns=30 * US, chunk_bytes=1)
    bench.offer(0, "fc", b"abc")
    bench.offer(28 * US, "modem", b"de")

    bench.run()

    assert [data for _, _, data in bench.heard] == [b"a", b"c", b"d"]
    assert bench.fates() == [Fate.DELIVERED, Fate.LOST, Fate.DELIVERED, Fate.DELIVERED, Fate.UNFINISHED]


def test_nothing_is_no_write():
    bench = Bench()
    bench.offer(0, "fc", b"")

    assert bench.run().fates() == [Fate.MALFORMED]


def byte_by_byte(writes, baud_bps, buffer_bytes, chunk_bytes):
    """(arrival_ns, data) of chunks: a queue of bytes and a register, moved on in exact time, byte after byte."""
    byte = Fraction(10 * 10**9, baud_bps)
    over = Fraction(0)          # when the byte in the register is over
    queue, arrived = [], []     # (byte, chunk ends here)

    def move_on(until):
        nonlocal over
        while queue and over <= until:
            over += byte
            arrived.append((over, *queue.pop(0)))

    for at_ns, data in writes:
        move_on(Fraction(at_ns))
        idle = not queue and over <= at_ns
        if len(data) > buffer_bytes - len(queue) + idle:
            continue
        if idle:
            over = Fraction(at_ns)
        size = chunk_bytes or len(data)
        queue += [(value, k % size == size - 1 or k == len(data) - 1) for k, value in enumerate(data)]
        move_on(Fraction(at_ns))
    move_on(Fraction(10**18))
    chunks, current = [], bytearray()
    for end, value, last in arrived:
        current.append(value)
        if last:
            chunks.append((end, bytes(current)))
            current.clear()
    return chunks


@given(st.lists(st.tuples(st.integers(0, 400_000), st.binary(min_size=1, max_size=12)), max_size=12),
       st.sampled_from([57_600, 115_200, 921_600, 3_000_000]), st.integers(1, 30), st.integers(0, 5))
def test_it_agrees_with_a_simulation_byte_by_byte(gaps, baud_bps, buffer_bytes, chunk_bytes):
    now_ns, writes = 0, []
    for gap_ns, data in gaps:
        now_ns += gap_ns
        writes.append((now_ns, data))
    bench = Bench(baud_bps=baud_bps, buffer_bytes=buffer_bytes, chunk_bytes=chunk_bytes)
    for at_ns, data in writes:
        bench.offer(at_ns, "fc", data)

    bench.run()
    expected = byte_by_byte(writes, baud_bps, buffer_bytes, chunk_bytes)

    assert [data for _, _, data in bench.heard] == [data for _, data in expected]
    for (arrival_ns, _, _), (end, _) in zip(bench.heard, expected, strict=True):
        assert arrival_ns == ceil(end)          # a stretch begins at a whole nanosecond, so both round alike


def gathered(chunks, byte_ns, idle_ns, buffer_bytes):
    """(arrival_ns, data) of a DMA buffer that is read when full or when the line is idle; `chunks` has single bytes."""
    handed, held, last_ns = [], b"", 0
    for end, value in chunks:
        if held and end - byte_ns >= last_ns + idle_ns:
            handed.append((last_ns + idle_ns, held))
            held = b""
        held, last_ns = held + value, end
        if len(held) == buffer_bytes:
            handed.append((end, held))
            held = b""
    return handed + [(last_ns + idle_ns, held)] * bool(held)


@given(st.lists(st.tuples(st.integers(0, 60_000), st.binary(min_size=1, max_size=12)), max_size=12),
       st.sampled_from([1_000_000, 2_500_000, 10_000_000]), st.integers(1, 30), st.integers(0, 9), st.integers(1, 5))
@example([(0, b"a"), (40_000, b"b")], 1_000_000, 9, 0, 3)           # silent for exactly three byte times
@example([(0, b"a"), (39_999, b"b")], 1_000_000, 9, 0, 3)
def test_the_idle_line_and_the_full_buffer_deliver_what_a_dma_would(gaps, baud_bps, buffer_bytes, chunk_bytes,
                                                                      idle_bytes):
    byte_ns = 10**10 // baud_bps            # whole nanoseconds, so nothing is rounded
    now_ns, writes = 0, []
    for gap_ns, data in gaps:
        now_ns += gap_ns
        writes.append((now_ns, data))
    bench = Bench(baud_bps=baud_bps, buffer_bytes=buffer_bytes, chunk_bytes=chunk_bytes, idle_bytes=idle_bytes)
    for at_ns, data in writes:
        bench.offer(at_ns, "fc", data)

    bench.run()

    assert [(at_ns, data) for at_ns, _, data in bench.heard] == gathered(
        byte_by_byte(writes, baud_bps, buffer_bytes, 1), byte_ns, idle_bytes * byte_ns, chunk_bytes)


def test_a_delivery_has_the_times_of_its_first_and_its_last_byte():
    bench = Bench(idle_bytes=3, receive_latency_ns=7)
    bench.offer(2 * US, "fc", b"ab")
    bench.offer(6 * US, "fc", b"cd")                # after two byte times of silence

    bench.run()

    assert bench.heard == [(11 * US + 7, "modem", b"abcd")]
    assert [(row["offered_ns"], row["on_air_ns"], row["end_ns"]) for row in bench.rows()] == [(2 * US, 2 * US, 8 * US)]


def test_what_waits_for_the_idle_line_at_the_end_is_unfinished():
    bench = Bench(idle_bytes=3, end_ns=5 * US)
    bench.offer(0, "fc", b"ab")                     # idle for long enough at 5 us, when the run is over

    assert bench.run().fates() == [Fate.UNFINISHED]
    assert bench.heard == []


@given(st.lists(st.tuples(st.integers(0, 30_000), st.sampled_from(["fc", "modem"]), st.integers(1, 12)), max_size=6),
       st.integers(0, 9), st.integers(1, 5), st.integers(0, 5_000), st.integers(0, 50_000), st.integers(1, 12))
def test_nothing_that_is_offered_later_is_handed_over_before_the_lookahead(gaps, chunk_bytes, idle_bytes, latency_ns,
                                                                            later_ns, size):
    def bench():
        found, now_ns = Bench(chunk_bytes=chunk_bytes, idle_bytes=idle_bytes, receive_latency_ns=latency_ns), 0
        for gap_ns, end, bytes_ in gaps:
            now_ns += gap_ns
            found.agenda.at(now_ns, OFFER, end, partial(found.line.offer, end, bytes(bytes_), now_ns))
        found.agenda.run_before(now_ns + 1)
        found.heard.clear()                         # known to the links
        return found, now_ns + 1

    found, t0_ns = bench()
    bound_ns = found.line.lookahead_ns(t0_ns)
    arrivals = []
    for end in ("fc", "modem"):
        tried, _ = bench()
        tried.agenda.at(t0_ns + later_ns, OFFER, end, partial(tried.line.offer, end, bytes(size), t0_ns + later_ns))
        tried.run()
        arrivals += [arrival_ns for arrival_ns, _, _ in tried.heard]

    assert all(arrival_ns >= bound_ns for arrival_ns in arrivals)


@given(st.integers(300, 20_000_000), st.lists(st.integers(1, 30), min_size=1, max_size=8), st.integers(0, 10_000_000))
def test_no_byte_arrives_before_the_lookahead(baud_bps, sizes, later_ns):
    bench = Bench(baud_bps=baud_bps)
    for size in sizes:
        bench.offer(0, "fc", bytes(size))
        bench.offer(0, "modem", bytes(size))
    bench.agenda.run_before(1)

    bound_ns = bench.line.lookahead_ns(1)
    bench.bounds_ns = []
    already = len(bench.heard)
    bench.agenda.at(1 + later_ns, OFFER, "fc", partial(bench.line.offer, "fc", b"x", 1 + later_ns))
    bench.run()

    assert all(arrival_ns >= bound_ns for arrival_ns, _, _ in bench.heard[already:])


@given(st.integers(300, 20_000_000), st.lists(st.integers(1, 30), max_size=5), st.lists(st.integers(1, 30), max_size=5),
       st.integers(1, 10_000_000), st.integers(0, 5_000))
@example(1_000_000, [1], [1], 9_999, 0)                 # both bytes end at 10 000 ns
@example(1_000_000, [1], [1], 9_000, 0)
@example(1_000_000, [1], [1], 10_000, 0)
def test_the_lookahead_is_when_the_first_byte_can_arrive(baud_bps, sizes, others_sizes, t0_ns, latency_ns):
    def bench():
        found = Bench(baud_bps=baud_bps, receive_latency_ns=latency_ns)
        for end, waiting in (("fc", sizes), ("modem", others_sizes)):
            for size in waiting:
                found.line.offer(end, bytes(size), 0)
        found.heard.clear()
        return found

    earliest_ns = END_NS
    for end in ("fc", "modem"):
        tried = bench()
        tried.line.offer(end, b"x", t0_ns)
        earliest_ns = min(earliest_ns, tried.heard[-1][0])
    bound_ns = bench().line.lookahead_ns(t0_ns)

    assert 0 <= earliest_ns - bound_ns <= 1             # 1 ns: the end of a byte in a stretch is rounded once


@pytest.mark.parametrize(("settings", "says"), [
    ({"baud_bps": 0}, "baud_bps=0: expected 1 to"), ({"data_bits": 9}, "data_bits=9: expected 5 to 8"),
    ({"stop_bits": 3}, "stop_bits=3: expected 1 or 2"), ({"buffer_bytes": 0}, "buffer_bytes=0"),
    ({"chunk_bytes": -1}, "chunk_bytes=-1"), ({"idle_bytes": -1}, "idle_bytes=-1"),
    ({"receive_latency_ns": -1}, "receive_latency_ns=-1")])
def test_nonsense_is_refused_with_its_rule(settings, says):
    with pytest.raises(ValueError, match=says):
        Bench(**settings)


def test_a_line_has_two_ends():
    with pytest.raises(ValueError, match="a serial line has two ends, this one 3: a, b, c"):
        SerialLine("uart", SerialLineSettings(57_600), ("a", "b", "c"), Agenda(), Ledger(),
                   Links(Ledger(), lambda *_: True, {}), lambda place: Random(place))
