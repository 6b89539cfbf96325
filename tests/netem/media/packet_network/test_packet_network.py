"""A packet network against closed forms, Pollaczek and Khinchine, and a brute-force simulation packet by packet."""

from __future__ import annotations

from functools import partial
from heapq import heappop, heappush
from itertools import pairwise
from math import ceil, log, sqrt
from random import Random
from statistics import mean, stdev

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import t as student

from netem.core.agenda import OFFER, Agenda
from netem.core.fate import Fate
from netem.core.random_streams import stream
from netem.impairments.bernoulli_loss import BernoulliLoss
from netem.impairments.corrupt import Corrupt
from netem.impairments.duplicate import Duplicate
from netem.impairments.scripted_loss import ScriptedLoss
from netem.media.links import Links
from netem.media.packet_network.datagram import Datagram, pack, unpack
from netem.media.packet_network.packet_network import PacketNetwork
from netem.media.packet_network.settings import LinkSettings, PacketNetworkSettings
from netem.media.replayed_links import RecordedCopy, RecordedFrame, ReplayedLinks
from netem.records.ledger import COLUMNS, Ledger
from tests.examples import examples

END_NS = 10**13
US = 1_000                  # a byte at 8 Mbit/s
STAR = {"switches": ("s",), "links": {"* <-> s": LinkSettings()}}


class Bench:
    def __init__(self, nodes="abc", pipelines=None, end_ns=END_NS, links_of=Links, **keys):
        self.agenda, self.ledger, self.heard, self.bounds_ns = Agenda(), Ledger(), [], []
        self.end_ns, self.tapped = end_ns, []
        self.lan = PacketNetwork("lan", PacketNetworkSettings(**{"rate_bps": 8_000_000, **keys}), nodes, self.agenda,
                                 self.ledger, links_of(self.ledger, self._deliver, {
                                     ("lan", *link): [(f"impairment {link[1]}", each)]
                                     for link, each in (pipelines or {}).items()}), Random)
        self.lan.taps.append(self)

    def frame(self, frame, seen_ns):
        self.tapped.append((frame.sender, frame.on_air_ns, seen_ns))

    def _deliver(self, receiver, medium, arrival_ns, data):
        assert all(arrival_ns >= bound_ns for bound_ns in self.bounds_ns)
        datagram = unpack(data)
        if arrival_ns < self.end_ns:
            self.heard.append((arrival_ns, datagram.source, receiver, datagram.payload))

    def offer(self, at_ns, sender, destination, payload):
        self.raw(at_ns, sender, pack(Datagram(destination, payload)))

    def raw(self, at_ns, sender, data):
        def act():
            self.bounds_ns = [self.lan.lookahead_ns(at_ns)]
            self.lan.offer(sender, data, at_ns)
        self.agenda.at(at_ns, OFFER, sender, act)

    def run(self):
        self.agenda.run_before(self.end_ns)
        self.lan.finish(self.end_ns)
        self.ledger.finish(end_ns=self.end_ns)
        return self

    def rows(self):
        return [dict(zip(COLUMNS, row, strict=True)) for row in self.ledger.rows]

    def fates(self):
        return [(row["receiver"], Fate(row["fate"]), row["cause"]) for row in self.rows()]


# --- times

@pytest.mark.parametrize(("rate_bps", "overhead_bytes", "delay_ns"), [
    (8_000_000, 0, 0), (10_000_000, 38, 50_000), (999_983, 0, 1), (1_000_000_000, 38, 5)])
def test_a_datagram_arrives_after_its_bytes_and_the_propagation_delay(rate_bps, overhead_bytes, delay_ns):
    bench = Bench("ab", rate_bps=rate_bps, overhead_bytes=overhead_bytes, delay_ns=delay_ns)
    bench.offer(7, "a", "b", bytes(100))

    bench.run()

    sending_ns = ceil(8 * (100 + 20 + overhead_bytes) * 10**9 / rate_bps)
    assert bench.heard == [(7 + sending_ns + delay_ns, "a", "b", bytes(100))]
    assert bench.tapped == [("a", 7, 7 + sending_ns)]


def test_a_switch_forwards_a_packet_when_its_last_bit_is_there():
    bench = Bench("ab", switches=("s",), links={"a <-> s": LinkSettings(), "s <-> b": LinkSettings(2_000_000, 9 * US)})
    bench.offer(0, "a", "b", bytes(80))

    bench.run()

    assert bench.heard == [((100 + 4 * 100 + 9) * US, "a", "b", bytes(80))]


def test_packets_that_reach_a_switch_at_once_are_queued_in_the_order_of_their_links_names():
    bench = Bench("abc", **STAR)
    bench.offer(0, "b", "c", bytes(30))             # at the switch after 50 us,
    bench.offer(10 * US, "a", "c", bytes(20))       # and so is this one, offered later

    bench.run()

    assert [(at_ns, source) for at_ns, source, *_ in bench.heard] == [((50 + 40) * US, "a"), ((50 + 40 + 50) * US, "b")]


def test_both_directions_of_a_link_are_sent_at_once():
    bench = Bench("ab")
    bench.offer(0, "a", "b", bytes(30))
    bench.offer(0, "b", "a", bytes(10))

    bench.run()

    assert [(at_ns, receiver) for at_ns, _, receiver, _ in sorted(bench.heard)] == [(30 * US, "a"), (50 * US, "b")]


def test_a_queue_of_constant_arrivals_and_service_grows_by_the_difference_until_it_is_full():
    """D/D/1 at a load of 4/3: frame k waits k (s - T) until `limit` packets wait, then one in four is dropped."""
    service, period, limit = 100 * US, 75 * US, 5
    bench = Bench("ab", queue_packets=limit)
    for k in range(400):
        bench.offer(k * period, "a", "b", bytes(80))

    bench.run()

    rows = bench.rows()
    waits = [row["on_air_ns"] - row["offered_ns"] for row in rows]
    dropped = [row["number"] for row in rows if row["fate"] == "queue full"]
    assert waits[:dropped[0]] == [k * (service - period) for k in range(dropped[0])]
    assert dropped[0] * (service - period) > (limit - 1) * service      # a full queue at the first drop
    assert {after - before for before, after in pairwise(dropped)} == {4}
    assert max(waits) <= limit * service
    assert bench.lan.counters()["lan"] == {"a -> b packets sent": 400 - len(dropped), "b -> a packets sent": 0,
                                           "a -> b packets dropped": len(dropped), "b -> a packets dropped": 0}


@pytest.mark.slow
@pytest.mark.parametrize("load", [0.3, 0.7])
def test_the_mean_wait_of_poisson_arrivals_is_that_of_pollaczek_and_khinchine(load):
    """M/D/1: W = rho s / (2 (1 - rho)). The interval is Student's, of independent replications after a warm-up."""
    service_ns, replications, warm_up, customers = 100 * US, 30, 500, 3_000
    means = []
    for replication in range(replications):
        rng, at_ns = stream(5, f"arrivals {load} {replication}"), 0
        bench = Bench("ab", queue_packets=10**6)
        for _ in range(customers):
            at_ns += round(-log(1 - rng.random()) * service_ns / load)
            bench.offer(at_ns, "a", "b", bytes(80))
        bench.run()
        means.append(mean(row["on_air_ns"] - row["offered_ns"] for row in bench.rows()[warm_up:]))

    expected_ns = load * service_ns / (2 * (1 - load))
    half_width_ns = student.ppf(1 - 1e-4, replications - 1) * stdev(means) / sqrt(replications)
    assert half_width_ns < 0.15 * expected_ns           # else the test would accept anything
    assert abs(mean(means) - expected_ns) < half_width_ns


# --- fragments

def test_a_datagram_longer_than_the_mtu_arrives_with_its_last_fragment():
    bench = Bench("ab", mtu_bytes=125, delay_ns=3 * US)        # room for 105 bytes: 104 in a fragment, 13 times 8
    payload = bytes(range(250))
    bench.offer(0, "a", "b", payload)

    bench.run()

    assert bench.heard == [((250 + 3 * 20 + 3) * US, "a", "b", payload)]
    assert bench.lan.counters()["lan"]["a -> b packets sent"] == 3


def test_fragments_follow_each_other_through_a_switch():
    """Store and forward is a pipeline: the second link sends a fragment while the first link sends the next."""
    bench = Bench("ab", mtu_bytes=120, **{**STAR, "links": {"a <-> s": LinkSettings(), "s <-> b": LinkSettings()}})
    bench.offer(0, "a", "b", bytes(4 * 96))

    bench.run()

    assert [at_ns for at_ns, *_ in bench.heard] == [(4 + 1) * 116 * US]


def test_the_smallest_mtu_of_the_way_decides():
    bench = Bench("ab", switches=("s",), links={"a <-> s": LinkSettings(mtu_bytes=1500),
                                                "s <-> b": LinkSettings(mtu_bytes=576)})
    bench.offer(0, "a", "b", bytes(1400))

    assert len(bench.run().heard) == 1
    assert bench.lan.counters()["lan"]["a -> s packets sent"] == ceil(1400 / 552)


def test_a_datagram_is_lost_with_one_of_its_fragments_and_the_others_use_the_link():
    bench = Bench("ab", {("a", "b"): ScriptedLoss(lose_frames=[1])}, mtu_bytes=120)
    bench.offer(0, "a", "b", bytes(3 * 96))         # fragments 0, 1, 2
    bench.offer(0, "a", "b", b"next")               # packet 3

    bench.run()

    assert bench.fates() == [("b", Fate.LOST, "impairment b"), ("b", Fate.DELIVERED, "")]
    assert bench.heard == [((3 * 116 + 24) * US, "a", "b", b"next")]


def test_a_fragment_that_a_queue_drops_takes_the_datagram_with_it():
    bench = Bench("ab", mtu_bytes=120, queue_packets=2)
    bench.offer(0, "a", "b", bytes(4 * 96))

    assert bench.run().fates() == [("b", Fate.QUEUE_FULL, "a -> b")]
    assert bench.lan.counters()["lan"] == {"a -> b packets sent": 3, "a -> b packets dropped": 1,
                                           "b -> a packets sent": 0, "b -> a packets dropped": 0}


def test_the_loss_ratio_of_datagrams_follows_from_that_of_packets():
    count, fragments, ratio = 4_000, 5, 0.03
    bench = Bench("ab", {("a", "b"): BernoulliLoss(ratio, rng=stream(3, "loss"))}, mtu_bytes=120, queue_packets=10)
    for k in range(count):
        bench.offer(k * 1_000 * US, "a", "b", bytes(fragments * 96))

    bench.run()

    lost = sum(fate is Fate.LOST for _, fate, _ in bench.fates())
    expected = 1 - (1 - ratio) ** fragments
    assert abs(lost / count - expected) < 4 * sqrt(expected * (1 - expected) / count)


def test_a_corrupt_fragment_is_found_by_the_checksum_or_arrives_corrupt():
    def run(checksum):
        bench = Bench("ab", {("a", "b"): Corrupt(rng=Random(1), frame_ratio=1.0)}, mtu_bytes=120, checksum=checksum)
        bench.offer(0, "a", "b", bytes(200))
        return bench.run()

    assert run(True).fates() == [("b", Fate.CORRUPTED, "checksum")]
    assert run(False).fates() == [("b", Fate.DELIVERED_CORRUPT, "")]
    assert len(run(False).heard[0][3]) == 200


def test_duplicates_are_of_whole_datagrams_not_of_fragments():
    duplicate = partial(Duplicate, duplicate_ratio=1.0, rng=Random(1))
    bench = Bench("ab", {("a", "b"): duplicate()}, mtu_bytes=120)
    bench.offer(0, "a", "b", bytes(200))
    bench.offer(0, "a", "b", b"short")

    bench.run()

    assert [payload for *_, payload in bench.heard] == [bytes(200), b"short", b"short"]


def test_the_fates_of_an_earlier_run_are_those_of_whole_datagrams():
    def replayed(ledger, deliver, pipelines):
        lost = RecordedFrame(0, 0, (RecordedCopy(Fate.LOST, 0),))
        late = RecordedFrame(1, 0, (RecordedCopy(Fate.DELIVERED, 7 * US),))
        return ReplayedLinks(ledger, deliver, {("lan", "a", "b"): [lost, late]}, by_instant=False)

    bench = Bench("ab", links_of=replayed, mtu_bytes=120)
    bench.offer(0, "a", "b", bytes(300))
    bench.offer(0, "a", "b", bytes(200))

    bench.run()

    assert bench.fates() == [("b", Fate.LOST, "as recorded"), ("b", Fate.DELIVERED, "")]
    assert bench.heard == [((300 + 4 * 20 + 200 + 3 * 20 + 7) * US, "a", "b", bytes(200))]


def test_longer_datagrams_are_refused_by_a_key():
    bench = Bench("ab", mtu_bytes=120, longer_than_mtu="refuse")
    bench.offer(0, "a", "b", bytes(101))
    bench.offer(0, "a", "b", bytes(100))

    assert bench.run().fates() == [("b", Fate.MALFORMED, "longer than 100 bytes"), ("b", Fate.DELIVERED, "")]


# --- addresses

def test_a_multicast_datagram_passes_each_link_once_and_each_copy_has_its_own_fate():
    bench = Bench("abcde", {("a", "c"): ScriptedLoss(lose_frames=[0])}, groups={"team": ("a", "b", "c", "d")},
                  switches=("s", "t"), queue_packets=0, links={
                      "a <-> s": LinkSettings(), "s <-> t": LinkSettings(), "[bc] <-> s": LinkSettings(),
                      "[de] <-> t": LinkSettings()})
    bench.offer(1 * US, "e", "d", bytes(400))           # keeps t -> d busy when the copy for d comes
    bench.offer(230 * US, "a", "team", bytes(80))

    bench.run()

    assert bench.fates() == [
        ("b", Fate.DELIVERED, ""), ("c", Fate.LOST, "impairment c"), ("d", Fate.DELIVERED, ""),     # this one is e's
        ("d", Fate.QUEUE_FULL, "t -> d")]
    sent = bench.lan.counters()["lan"]
    assert [sent[f"{link} packets sent"] for link in ("a -> s", "s -> t", "s -> b", "s -> c", "t -> e")] == [
        1, 1, 1, 1, 0]


def test_everyone_is_every_other_node():
    bench = Bench("abc", **STAR)
    bench.offer(0, "b", "*", b"hello")

    assert {(source, receiver) for _, source, receiver, _ in bench.run().heard} == {("b", "a"), ("b", "c")}


@pytest.mark.parametrize(("destination", "cause"), [
    ("a", "addressed to its sender, a"), ("team_", "no node or group is called 'team_': did you mean 'team'?")])
def test_a_datagram_without_a_receiver_is_malformed(destination, cause):
    bench = Bench("abc", groups={"team": ("b",)})
    bench.offer(0, "a", destination, b"")

    assert bench.run().fates() == [("b", Fate.MALFORMED, cause), ("c", Fate.MALFORMED, cause)]


@pytest.mark.parametrize("data", [b"", b"\0", b"\0\x05b", b"\0\x01\xff", b"\x03\x01b"])
def test_bytes_without_a_header_are_malformed(data):
    bench = Bench("ab")
    bench.raw(0, "a", data)

    assert bench.run().fates() == [("b", Fate.MALFORMED, "no header with the destination")]


def test_a_one_way_link_has_no_way_back():
    bench = Bench("ab", links={"a -> b": LinkSettings()})
    bench.offer(0, "b", "a", b"")

    assert bench.lan.links(1) == [("a", "b")]
    assert bench.run().fates() == [("a", Fate.MALFORMED, "no path from b to a")]


@given(st.text(max_size=20), st.text(max_size=20), st.binary(max_size=20))
def test_a_header_reads_back(source, destination, payload):
    assert unpack(pack(Datagram(destination, payload, source))) == Datagram(destination, payload, source)


@given(st.binary(max_size=12))
def test_any_bytes_are_read_or_refused(data):
    datagram = unpack(data)

    assert datagram is None or pack(datagram) == data


# --- the lookahead and the end

def test_the_lookahead_of_idle_links_is_that_of_the_shortest_packet_and_it_is_reached():
    bench = Bench("abc", delay_ns=30 * US, links={"a <-> b": LinkSettings(), "b <-> c": LinkSettings(delay_ns=9 * US)})

    bound_ns = bench.lan.lookahead_ns(1_000)
    bench.offer(1_000, "c", "b", b"")

    assert bound_ns == 1_000 + (20 + 9) * US
    assert [at_ns for at_ns, *_ in bench.run().heard] == [bound_ns]


def test_the_lookahead_counts_what_a_link_has_to_send_and_the_last_fragment_ahead_of_a_switch():
    bench = Bench("ab", mtu_bytes=120, **STAR)
    bench.lan.offer("b", pack(Datagram("a", bytes(96))), 0)             # b's link is busy for 116 us, as a's
    bench.lan.offer("a", pack(Datagram("b", bytes(10 * 96))), 0)        # is for 1160 us

    assert bench.lan.lookahead_ns(50 * US) == (116 + 2 * 20) * US       # a shortest one behind b's first
    bench.agenda.run_before(116 * US + 1)
    assert bench.lan.lookahead_ns(1_150 * US) == 1_190 * US             # a shortest one of b, offered now
    assert bench.lan.lookahead_ns(1_250 * US) == 1_276 * US             # the last fragment of a arrives


def test_what_is_on_its_way_at_the_end_is_unfinished():
    bench = Bench("abc", end_ns=150 * US, groups={"team": ("b", "c")}, switches=("s",), links={
        "[ab] <-> s": LinkSettings(), "c <-> s": LinkSettings(80_000)})
    bench.offer(0, "a", "team", bytes(20))              # 40 us a link, 4 ms to c
    bench.offer(120 * US, "a", "team", bytes(20))       # at the switch after the end

    assert bench.run().fates() == [
        ("b", Fate.DELIVERED, ""), ("c", Fate.UNFINISHED, "under way"), ("b", Fate.UNFINISHED, "under way"),
        ("c", Fate.UNFINISHED, "under way")]


# --- against a second implementation

TREE = {"switches": ("s", "t"), "mtu_bytes": 60, "queue_packets": 3, "links": {
    "a <-> s": LinkSettings(8_000_000, 5_000), "b <-> s": LinkSettings(3_000_000, 0),
    "s <-> t": LinkSettings(2_500_000, 12_345, queue_packets=5), "c <-> t": LinkSettings(8_000_000, 1),
    "d <-> t": LinkSettings(1_000_000, 777, queue_bytes=150)}}
PATHS = {"a": "s", "b": "s", "c": "t", "d": "t"}


def packet_by_packet(offers):
    """(arrival, source, receiver, payload) of every copy that arrives: one event a packet and link, all of it kept."""
    events, sequence, sent, got, heard = [], 0, {}, {}, []

    def enter(now, link, packet):
        nonlocal sequence
        number, _, size, index, count = packet
        own = TREE["links"].get(f"{link[0]} <-> {link[1]}") or TREE["links"][f"{link[1]} <-> {link[0]}"]
        records = sent.setdefault(link, [])
        waiting = [bytes_ for start, _, bytes_ in records if start > now]
        start = max([now, *(end for _, end, _ in records)])
        limit = 3 if own.queue_packets is None else own.queue_packets
        too_many = own.queue_bytes is not None and sum(waiting) + size > own.queue_bytes
        if start > now and (len(waiting) >= limit or too_many):
            return
        end = start + ceil(8 * 10**9 * size / own.rate_bps)
        records.append((start, end, size))
        if link[1] in PATHS:
            key = number, link[1]
            got.setdefault(key, []).append(index)
            if len(got[key]) == count:
                heard.append((end + own.delay_ns, offers[number][1], link[1], offers[number][3]))
        else:
            sequence += 1
            heappush(events, (end + own.delay_ns, 0, f"{link[0]} -> {link[1]}", sequence, link[1], packet))

    for number, (at, sender, *_) in enumerate(offers):
        heappush(events, (at, 2, sender, number - len(offers), "", number))
    while events:
        now, _, _, _, switch, what = heappop(events)
        if not switch:
            _, sender, destination, payload = offers[what]
            receivers = [node for node in PATHS if node != sender and destination in (node, "*")]
            pieces = [payload] if len(payload) <= 40 else [payload[k:k + 40] for k in range(0, len(payload), 40)]
            for index, piece in enumerate(pieces):
                enter(now, (sender, PATHS[sender]), (what, receivers, 20 + len(piece), index, len(pieces)))
            continue
        ways = {}
        for receiver in what[1]:
            ways.setdefault(receiver if PATHS[receiver] == switch else PATHS[receiver], []).append(receiver)
        for head, behind in ways.items():
            enter(now, (switch, head), (what[0], behind, *what[2:]))
    return sorted(heard)


@settings(deadline=None, max_examples=examples(150))
@given(st.lists(st.tuples(st.integers(0, 300_000), st.sampled_from("abcd"), st.sampled_from("abcd*"),
                          st.binary(max_size=130)), max_size=25))
def test_it_agrees_with_a_simulation_packet_by_packet_and_nothing_arrives_below_the_lookahead(gaps):
    at_ns, offers = 0, []
    for gap_ns, sender, destination, payload in gaps:
        at_ns += gap_ns + 1             # offers of one instant would be ordered by name
        if sender != destination:
            offers.append((at_ns, sender, destination, payload))
    bench = Bench("abcd", **TREE)
    for offer in offers:
        bench.offer(*offer)

    bench.run()         # checks conservation and the lookahead

    assert sorted(bench.heard) == packet_by_packet(offers)


# --- settings

@pytest.mark.parametrize(("keys", "message"), [
    ({"rate_bps": 0}, "rate_bps=0: expected at least 1"),
    ({"rate_bps": 10**13}, "expected at most 1000000000000"),
    ({"mtu_bytes": 27}, "mtu_bytes=27: expected at least header_bytes \\+ 8 = 28"),
    ({"header_bytes": 0}, "header_bytes=0: expected at least 1: a packet names its receiver"),
    ({"delay_ns": -1}, "delay_ns=-1: expected at least 0"),
    ({"links": {"a <-> b": LinkSettings(queue_packets=-1)}}, "links: a <-> b: queue_packets=-1: expected at least 0"),
    ({"groups": {"team": ()}}, r"groups: team=\[\]: expected at least one node"),
    ({"groups": {"*": ("a",)}}, "this name means all nodes"),
    ({"groups": {"team": ("a", "x")}}, "groups: team: no node is called 'x'"),
    ({"groups": {"a": ("b",)}}, "groups: a: a node has this name"),
    ({"switches": ("a",), "links": {"b <-> a": LinkSettings()}}, "switches: a: a node has this name"),
    ({"switches": ("s",)}, "links does not say what is connected to them"),
    ({"links": {"a - b": LinkSettings()}}, "expected 'sender -> receiver' or 'node <-> node'"),
    ({"links": {"a <-> x": LinkSettings()}}, "no node is called 'x'"),
    ({"links": {"a <-> b": LinkSettings()}}, 'c is on no path to another node: connect it, for example "c <-> a"'),
])
def test_settings_that_do_not_fit_are_refused(keys, message):
    with pytest.raises(ValueError, match=message):
        Bench("abc", **keys)
