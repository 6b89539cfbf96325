"""Propagation times against brute force: every flight is shifted to the receiver, then nothing propagates."""

import random
from functools import partial
from math import dist

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netem.core.agenda import SHOW
from netem.core.fate import Fate
from netem.topology.path_loss import PathLoss
from tests.examples import examples
from tests.netem.media.radio_bench import BYTE_PER_US, US, Bench
from tests.netem.media.test_decoding import CAPTURE_DB, SENSITIVITY_DBM, expected_fate
from tests.netem.media.test_radio_lookahead import MACS, SENSE, windows

METRE_PER_US = 1e6                              # [m/s]
EVERYWHERE = 200.0                              # [dB] of fringe: every node is an intended receiver
LINE = {"a": (0.0, 0.0), "b": (10.0, 0.0), "c": (30.0, 0.0)}


def on_line(**settings):
    return Bench(LINE, topology=PathLoss("positions", propagation_mps=METRE_PER_US), **BYTE_PER_US, **settings)


def test_a_frame_arrives_later_by_the_time_of_its_way():
    bench = on_line(receive_latency_ns=7).run([(0, "a", 5)])

    assert [(at_ns, receiver) for at_ns, receiver, _ in bench.heard] == [(15 * US + 7, "b"), (35 * US + 7, "c")]


def test_back_to_back_frames_collide_where_the_second_comes_sooner():
    places = {"a": (0.0, 0.0), "b": (10.0, 0.0), "near": (12.0, 0.0), "far": (-10.0, 0.0)}
    bench = Bench(places, topology=PathLoss("positions", propagation_mps=METRE_PER_US), **BYTE_PER_US)

    bench.run([(0, "a", 5), (5 * US, "near", 5)])

    assert bench.fate("a", 0, "b") is Fate.COLLIDED             # [10, 15) us, and that of near [7, 12) us
    assert bench.fate("a", 0, "far") is Fate.DELIVERED          # [10, 15) us and [27, 32) us


def test_frames_that_overlap_at_their_senders_miss_one_another_where_they_come_in_turn():
    places = {"a": (0.0, 0.0), "b": (10.0, 0.0), "c": (30.0, 0.0)}
    bench = Bench(places, topology=PathLoss("positions", propagation_mps=METRE_PER_US), **BYTE_PER_US)

    bench.run([(0, "a", 5), (0, "c", 5)])

    assert bench.fate("a", 0, "b") is bench.fate("c", 0, "b") is Fate.DELIVERED         # [10, 15) and [20, 25) us
    assert bench.fate("a", 0, "c") is Fate.DELIVERED            # c has sent its own frame long before


@pytest.mark.parametrize("rule", ["radio_network", "local", "capture"])
def test_random_traffic_ends_as_brute_force_says(rule):
    seen = set()
    for seed in range(120):
        rng = random.Random(f"{rule}/{seed}")
        places = {node: (rng.uniform(0, 25), rng.uniform(0, 25)) for node in "abcde"}
        law = PathLoss("positions", propagation_mps=METRE_PER_US, fringe_db=EVERYWHERE, exponent=3.0)
        bench = Bench(places, topology=law, decode=rule, capture_db=CAPTURE_DB, sensitivity_dbm=SENSITIVITY_DBM,
                      tx_power_dbm=-10.0, **BYTE_PER_US)
        levels = {(one, other): -10.0 - law.loss_db(places[one], places[other])
                  for one in places for other in places if one != other}

        bench.run([(rng.randrange(100) * US, rng.choice("abcde"), rng.randrange(1, 15)) for _ in range(15)])

        flights = {(sender, number): (sender, start_ns, end_ns) for sender, number, start_ns, end_ns in bench.flights}
        for (sender, number, receiver), (fate,) in bench.ledger.fates.items():
            if (sender, number) in flights:
                def there(flight, receiver=receiver, places=places):
                    delay_ns = round(dist(places[flight[0]], places[receiver]) / METRE_PER_US * 1e9)
                    return flight[0], flight[1] + delay_ns, flight[2] + delay_ns

                wanted = there(flights[sender, number])
                assert fate is expected_fate(rule, levels, [there(flight) for flight in flights.values()], wanted,
                                             receiver), (seed, wanted, receiver)
                seen.add(fate)
    assert seen == {"radio_network": {Fate.DELIVERED, Fate.DEAF, Fate.TOO_WEAK, Fate.COLLIDED},
                    "capture": {Fate.DELIVERED, Fate.DEAF, Fate.TOO_WEAK, Fate.COLLIDED},
                    "local": {Fate.DELIVERED, Fate.TOO_WEAK}}[rule]


@pytest.mark.parametrize(("mac", "scheme"), MACS)
@settings(max_examples=examples(60), deadline=None)
@given(offers=st.lists(st.tuples(st.integers(0, 30 * US), st.sampled_from("abc"), st.integers(0, 6)), max_size=25),
       slack_ns=st.lists(st.integers(0, 3 * US), max_size=40))
def test_no_arrival_lies_before_a_bound_given_earlier(mac, scheme, offers, slack_ns):
    bench = Bench(LINE, mac=mac, csma=SENSE[scheme], receive_latency_ns=250, bit_rate_bps=8_000_000, preamble_ns=0,
                  header_bits=4, topology=PathLoss("positions", propagation_mps=3e7))

    windows(bench, offers, slack_ns)

    bench.radio.finish(bench.agenda.now_ns)
    assert bench.ledger.expected == sum(bench.ledger.closed.values())


def test_a_carrier_is_sensed_where_and_when_it_is():
    bench = on_line(mac="csma", csma=SENSE["dcf"])

    bench.run([(0, "a", 20), (12 * US, "b", 5), (12 * US, "c", 5)])

    starts = {sender: start_ns for sender, _, start_ns, _ in bench.flights}
    assert starts["b"] > 30 * US                # a's carrier is at b during [10, 30) us
    assert starts["c"] < 30 * US                # and at c from 30 us on


def test_nothing_is_kept_of_frames_that_are_decided_or_that_nobody_hears():
    places = LINE | {"lost": (1e6, 0.0)}
    bench = Bench(places, topology=PathLoss("positions", propagation_mps=METRE_PER_US), **BYTE_PER_US)

    bench.run([(k * 7 * US, "abc"[k % 3], 9) for k in range(30)] + [(5 * US, "lost", 5)])

    propagation = bench.radio._propagation
    assert (propagation._due_ns, propagation._undecided) == ([], {})
    assert all(flight.rivals == [] for flight in propagation._near)


def test_copies_still_on_their_way_at_the_end_are_unfinished():
    bench = on_line().run([(0, "a", 5)], until_ns=16 * US)

    assert [bench.fate("a", 0, node) for node in "bc"] == [Fate.DELIVERED, Fate.UNFINISHED]


def test_a_robot_that_comes_closer_does_not_collide_with_itself():
    bench = Bench({"base": (0.0, 0.0), "rover": None}, **BYTE_PER_US, topology=PathLoss(
        "positions", propagation_mps=METRE_PER_US, bodies={"rover": ("x", "y")}))
    for t_ns, x_m in ((0, 30.0), (5 * US, 20.0)):
        bench.agenda.at(t_ns, SHOW, "rover", partial(bench.radio.show, "rover", (x_m, 0.0), t_ns))

    bench.run([(0, "rover", 5), (5 * US, "rover", 5)])

    assert [(at_ns, receiver) for at_ns, receiver, _ in bench.heard] == [(30 * US, "base"), (35 * US, "base")]
