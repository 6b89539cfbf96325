"""What holds for every combination of decode rule and MAC, whatever the traffic."""

import random
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netem.core.fate import Fate
from netem.topology.switching_graph import GraphChange, SwitchingGraph
from tests.examples import examples
from tests.netem.media.radio_bench import BYTE_PER_US, US, Bench, csma
from tests.netem.media.test_radio_lookahead import MACS, SENSE

NODES = ["a", "b", "c", "d"]
DECODES = ["radio_network", "local", "capture"]
OFFERS = st.lists(st.tuples(st.integers(0, 40 * US), st.sampled_from(NODES), st.integers(0, 9)), max_size=30)
SWITCHING = SwitchingGraph("switching", {"ring": ("a <-> b", "b <-> c", "c <-> d", "d <-> a"), "star": ("a <-> *",)},
                           (GraphChange(0, "ring"), GraphChange(7 * US, "star")), repeat_ns=11 * US,
                           levels_dbm={"a -> *": -50.0, "c -> b": -97.0})
BEFORE_THE_AIR = {Fate.SENDER_BUSY, Fate.QUEUE_FULL, Fate.CHANNEL_BUSY, Fate.MALFORMED}
ON_THE_AIR = {Fate.DELIVERED, Fate.COLLIDED, Fate.DEAF, Fate.TOO_WEAK}

every_kind = pytest.mark.parametrize(("decode", "mac", "scheme"),
                                     [(decode, mac, scheme) for decode in DECODES for mac, scheme in MACS])


def bench_of(decode, mac, scheme, seed=7):
    return Bench(NODES, rng_for=lambda place: random.Random(f"{seed}/{place}"), decode=decode, mac=mac,
                 csma=SENSE[scheme], queue_frames=3, max_payload_bytes=8, topology=SWITCHING, **BYTE_PER_US)


@every_kind
@settings(max_examples=examples(25), deadline=None)
@given(offers=OFFERS, end_ns=st.integers(0, 80 * US))
def test_every_expected_copy_ends_once_wherever_the_run_ends(decode, mac, scheme, offers, end_ns):
    bench = bench_of(decode, mac, scheme)

    bench.run([offer for offer in offers if offer[0] < end_ns], until_ns=end_ns)

    assert all(len(fates) == 1 for fates in bench.ledger.fates.values())
    assert bench.ledger.expected == len(bench.ledger.fates)
    assert bench.ledger.closed[Fate.DELIVERED] == len(bench.heard)


@every_kind
@settings(max_examples=examples(25), deadline=None)
@given(offers=OFFERS)
def test_a_node_sends_one_frame_at_a_time_in_the_order_they_were_handed_out(decode, mac, scheme, offers):
    bench = bench_of(decode, mac, scheme)

    bench.run(offers)

    for node in NODES:
        flights = [flight for flight in bench.flights if flight[0] == node]
        assert all(earlier[1] < later[1] and earlier[3] <= later[2] for earlier, later in pairwise(flights))


@every_kind
@settings(max_examples=examples(25), deadline=None)
@given(offers=OFFERS)
def test_a_copy_has_a_fate_of_the_air_exactly_if_its_frame_was_on_it(decode, mac, scheme, offers):
    bench = bench_of(decode, mac, scheme)

    bench.run(offers)

    flown = {(sender, number): start_ns for sender, number, start_ns, _ in bench.flights}
    for (sender, number, receiver), (fate,) in bench.ledger.fates.items():
        assert fate in (ON_THE_AIR if (sender, number) in flown else BEFORE_THE_AIR)
        if (sender, number) in flown:
            assert (sender, receiver) in bench.radio.topology.graph_at(flown[sender, number]) or fate in (
                Fate.TOO_WEAK, Fate.DEAF)


@every_kind
@settings(max_examples=examples(10), deadline=None)
@given(offers=OFFERS, seed=st.integers(0, 5))
def test_the_same_offers_and_seed_give_the_same_ledger(decode, mac, scheme, offers, seed):
    first, second = (bench_of(decode, mac, scheme, seed).run(offers) for _ in range(2))

    assert first.ledger.fates == second.ledger.fates
    assert first.heard == second.heard


@every_kind
def test_a_lone_frame_always_gets_through(decode, mac, scheme):
    bench = bench_of(decode, mac, scheme)

    bench.run([(1000, "a", 8)])

    assert bench.ledger.closed == {Fate.DELIVERED: 2}


def test_another_node_does_not_change_the_draws_of_a_node():
    sense = csma(scheme="unslotted", slot_ns=50 * US, wait_ns=0, cca_ns=0, turnaround_ns=1, min_exponent=8,
                 max_exponent=8, max_attempts=5)
    alone = Bench(NODES, decode="local", mac="csma", csma=sense, **BYTE_PER_US)
    beside = Bench([*NODES, "e"], decode="local", mac="csma", csma=sense, **BYTE_PER_US)

    alone.run([(0, "a", 1)])
    beside.run([(0, "a", 1), (0, "e", 1)])

    assert alone.flights[0] in beside.flights
