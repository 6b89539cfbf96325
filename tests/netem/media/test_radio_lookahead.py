"""The lookahead is a promise to the windows: nothing may ever arrive before a bound that was given out."""

from functools import partial

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netem.core.agenda import OFFER
from netem.wire.instants import NEVER_NS
from tests.examples import examples
from tests.netem.media.radio_bench import US, Bench, csma

NODES = ["a", "b", "c"]
SENSE = {"unslotted": csma(scheme="unslotted", slot_ns=700, wait_ns=0, cca_ns=300, turnaround_ns=400, min_exponent=1,
                           max_exponent=3, max_attempts=3),
         "dcf": csma(scheme="dcf", slot_ns=700, wait_ns=900, cca_ns=0, turnaround_ns=400, min_exponent=2,
                     max_exponent=2)}
MACS = [("none", "unslotted"), ("aloha", "unslotted"), ("csma", "unslotted"), ("csma", "dcf")]


def windows(bench, offers, slack_ns):
    """Run as the conductor does; the bench checks every arrival against every bound given before."""
    offers = sorted(offers)
    agenda, radio = bench.agenda, bench.radio
    slack = iter(slack_ns)
    while offers or agenda.next_ns() < NEVER_NS:
        next_out_ns = offers[0][0] if offers else NEVER_NS
        while agenda.next_ns() < next_out_ns:
            if next(slack, 0) % 2:      # now and then a bound is asked for amid the events
                t0_ns = max(agenda.now_ns, agenda.next_ns() - next(slack, 0))
                bench.bounds_ns.append(radio.lookahead_ns(t0_ns))
            agenda.run_before(agenda.next_ns() + 1)
        if not offers:
            return
        t0_ns = max(agenda.now_ns, min(agenda.next_ns(), next_out_ns) - next(slack, 0))
        horizon_ns = radio.lookahead_ns(t0_ns)
        assert horizon_ns >= t0_ns
        bench.bounds_ns.append(horizon_ns)
        limit_ns = max(horizon_ns, next_out_ns + 1)
        while offers and offers[0][0] < limit_ns:
            at_ns, sender, size_bytes = offers.pop(0)
            agenda.at(at_ns, OFFER, sender, partial(radio.offer, sender, bytes(size_bytes), at_ns))
        agenda.run_before(limit_ns)


@pytest.mark.parametrize(("mac", "scheme"), MACS)
@pytest.mark.parametrize("latency_ns", [0, 250])
@settings(max_examples=examples(60), deadline=None)
@given(offers=st.lists(st.tuples(st.integers(0, 30 * US), st.sampled_from(NODES), st.integers(0, 6)), max_size=25),
       slack_ns=st.lists(st.integers(0, 3 * US), max_size=40))
def test_no_arrival_lies_before_a_bound_given_earlier(mac, scheme, latency_ns, offers, slack_ns):
    bench = Bench(NODES, mac=mac, csma=SENSE[scheme], receive_latency_ns=latency_ns,
                  bit_rate_bps=8_000_000, preamble_ns=0, header_bits=4)

    windows(bench, offers, slack_ns)

    bench.radio.finish(bench.agenda.now_ns)
    assert bench.ledger.expected == sum(bench.ledger.closed.values())


def test_an_idle_radio_promises_the_shortest_frame_and_a_zero_payload_meets_it():
    bench = Bench(NODES, preset="crazyflie_p2p", receive_latency_ns=100)

    assert bench.radio.lookahead_ns(5_000) == 5_000 + 44_500 + 100
    bench.run([(5_000, "a", 0)])
    assert bench.heard[0][0] == 5_000 + 44_500 + 100


def test_a_busy_radio_promises_the_first_end_on_the_air_if_that_is_sooner():
    bench = Bench(NODES, preset="crazyflie_p2p", receive_latency_ns=100)
    bench.offer(0, "a", 0)
    bench.agenda.run_before(1)

    assert bench.radio.lookahead_ns(1_000) == 44_500 + 100
    assert bench.radio.lookahead_ns(44_400) == 44_500 + 100


def test_carrier_sense_adds_its_least_wait_until_a_frame_is_waiting():
    bench = Bench(NODES, preset="xbee_802154", mac="csma")
    shortest_ns, wait_ns = 608 * US, (128 + 192) * US

    assert bench.radio.lookahead_ns(0) == wait_ns + shortest_ns
    bench.offer(0, "a", 0)
    bench.agenda.run_before(1)
    assert bench.radio.lookahead_ns(128 * US) == 128 * US + shortest_ns
    bench.run()
    assert bench.heard[0][0] == wait_ns + shortest_ns


def test_a_radio_without_airtime_promises_nothing_ahead():
    assert Bench(NODES).radio.lookahead_ns(77) == 77
