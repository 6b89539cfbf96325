"""MACs: hand-made timelines, the closed forms of ALOHA, and carrier sense against enumeration of its draws."""

import random
from math import exp, sqrt

import numpy as np
import pytest

from netem.core.fate import Fate
from netem.media.radio_presets import PRESETS
from netem.topology.switching_graph import GraphChange, SwitchingGraph
from tests.netem.media.radio_bench import BYTE_PER_US, US, Bench, csma, graph

STANDARD_ERRORS = 4         # that an estimate may lie off


class Scripted:
    """A random stream that says what it was told to, node by node."""

    def __init__(self, *slots):
        self.slots = list(slots)

    def getrandbits(self, bits):
        slots = self.slots.pop(0)
        assert slots < 2 ** bits
        return slots


def scripted(**slots):
    return lambda place: Scripted(*slots.get(place.rpartition(".")[2], ()))


def starts(bench):
    return [(sender, start_ns) for sender, _, start_ns, _ in bench.flights]


# ALOHA

def test_aloha_sends_its_queue_in_order_and_back_to_back():
    bench = Bench(["a", "b"], mac="aloha", **BYTE_PER_US)

    bench.run([(0, "a", 10), (1 * US, "a", 5), (2 * US, "a", 5), (15 * US, "a", 1)])

    assert starts(bench) == [("a", 0), ("a", 10 * US), ("a", 15 * US), ("a", 20 * US)]
    assert bench.ledger.closed == {Fate.DELIVERED: 4}


def test_a_full_queue_turns_frames_away():
    bench = Bench(["a", "b"], mac="aloha", queue_frames=1, **BYTE_PER_US)

    bench.run([(0, "a", 10), (1 * US, "a", 10), (2 * US, "a", 10), (10 * US, "a", 10)])

    assert [bench.fate("a", number, "b") for number in range(4)] == [
        Fate.DELIVERED, Fate.DELIVERED, Fate.QUEUE_FULL, Fate.DELIVERED]


def test_frames_still_queued_when_the_run_ends_are_unfinished():
    bench = Bench(["a", "b"], mac="aloha", **BYTE_PER_US)

    bench.run([(0, "a", 10), (1 * US, "a", 10)], until_ns=5 * US)

    assert bench.ledger.closed == {Fate.UNFINISHED: 2}


def test_a_queued_frame_counts_for_those_in_range_when_it_starts():
    switching = SwitchingGraph("switching", {"pair": ("a -> b",), "all": ("a -> b", "a -> c", "a -> d")},
                               (GraphChange(0, "pair"), GraphChange(5 * US, "all")))
    bench = Bench(["a", "b", "c", "d"], mac="aloha", topology=switching, **BYTE_PER_US)

    bench.run([(0, "a", 10), (1 * US, "a", 10)])

    assert bench.ledger.closed == {Fate.DELIVERED: 1 + 3}


def poisson_arrivals(rng, load, airtime_ns, frames, size_bytes=10):
    """Every frame from another node than the ones around it, so that no sender waits for itself."""
    t = 0.0
    for k in range(frames):
        t += rng.expovariate(load / airtime_ns)
        yield round(t), f"n{k % 20}", size_bytes


@pytest.mark.parametrize("mac", ["none", "aloha"])
@pytest.mark.parametrize("load", [0.2, 0.5, 1.0])
def test_pure_aloha_carries_g_exp_minus_2g(load, mac):
    airtime_ns, frames = 10 * US, 3000
    nodes = [f"n{k}" for k in range(20)]
    bench = Bench([*nodes, "hub"], topology=graph("n* -> hub", "hub -> n*"), mac=mac, **BYTE_PER_US)

    bench.run(poisson_arrivals(random.Random(f"{mac}{load}"), load, airtime_ns, frames))

    # A frame gets through if the gaps before and after it both exceed an airtime; neighbours share a gap.
    p = exp(-load)
    sigma = sqrt((p ** 2 * (1 - p ** 2) + 2 * (p ** 3 - p ** 4)) / frames)
    ends = 2 / frames                       # the first and the last frame have only one neighbour
    assert abs(bench.ledger.closed[Fate.DELIVERED] / frames - exp(-2 * load)) < STANDARD_ERRORS * sigma + ends


@pytest.mark.parametrize("load", [0.5, 1.0, 1.5])
def test_slotted_aloha_carries_g_exp_minus_g(load):
    slots, rng = 3000, random.Random(f"slotted{load}")
    bench = Bench([*(f"n{k}" for k in range(20)), "hub"], topology=graph("n* -> hub"), **BYTE_PER_US)
    offers = [(at_ns // (10 * US) * 10 * US, sender, size)
              for at_ns, sender, size in poisson_arrivals(rng, load, 10 * US, round(slots * load * 1.2))]

    bench.run([offer for offer in offers if offer[0] < slots * 10 * US])

    carried = load * exp(-load)
    sigma = sqrt(carried * (1 - carried) / slots)
    assert abs(bench.ledger.closed[Fate.DELIVERED] / slots - carried) < STANDARD_ERRORS * sigma


def test_on_a_complete_graph_all_receivers_lose_or_get_a_frame_together():
    nodes = [f"n{k}" for k in range(20)]
    bench = Bench(nodes, **BYTE_PER_US)

    bench.run(poisson_arrivals(random.Random("complete"), 0.5, 10 * US, 300))

    for sender, number, _, _ in bench.flights:
        fates = {bench.fate(sender, number, receiver) for receiver in nodes if receiver != sender}
        assert fates == {Fate.DELIVERED} or Fate.DELIVERED not in fates


# Carrier sense, unslotted (IEEE 802.15.4)

UNSLOTTED = {"scheme": "unslotted", "slot_ns": 100, "wait_ns": 0, "cca_ns": 40, "turnaround_ns": 30,
             "max_attempts": 3}


def test_an_idle_channel_costs_back_off_listening_and_turnaround():
    bench = Bench(["a", "b"], rng_for=scripted(a=[2]), mac="csma",
                  csma=csma(min_exponent=2, max_exponent=2, **UNSLOTTED), **BYTE_PER_US)

    bench.run([(1000, "a", 1)])

    assert starts(bench) == [("a", 1000 + 2 * 100 + 40 + 30)]


def test_a_busy_channel_widens_the_back_off_and_the_last_attempt_gives_up():
    sense = csma(min_exponent=1, max_exponent=2, **UNSLOTTED)
    bench = Bench(["a", "b", "c"], rng_for=scripted(a=[0], b=[1, 3, 2], c=[]), mac="csma", csma=sense,
                  topology=graph("a <-> b", "b -> c"), **BYTE_PER_US)
    bench.run([(0, "a", 1), (0, "b", 1)])
    # a: 40 + 30 .. 1070. b looks at [100, 140), [440, 480), [680, 720): busy, busy, busy.

    assert starts(bench) == [("a", 70)]
    assert bench.fate("b", 0, "a") is Fate.CHANNEL_BUSY
    assert bench.fate("b", 0, "c") is Fate.CHANNEL_BUSY


@pytest.mark.parametrize(("second_ns", "attempts"), [
    (1069 - 100, 2),        # looks at [1069, 1109): a is on the air up to 1070
    (1070 - 100, 1),        # looks at [1070, 1110)
])
def test_a_carrier_at_any_time_of_the_look_is_noticed(second_ns, attempts):
    sense = csma(min_exponent=1, max_exponent=1, **UNSLOTTED)
    bench = Bench(["a", "b"], rng_for=scripted(a=[0], b=[1, 1]), mac="csma", csma=sense, **BYTE_PER_US)

    bench.run([(0, "a", 1), (second_ns, "b", 1)])

    assert starts(bench) == [("a", 70), ("b", second_ns + attempts * 140 + 30)]


@pytest.mark.parametrize(("second_ns", "fate"), [
    (30, Fate.DEAF),        # decides at 70 when a's first bit is just out: a turnaround after a's decision
    (31, Fate.DELIVERED),   # decides at 71 and hears it
])
def test_two_nodes_that_decide_within_the_turnaround_collide(second_ns, fate):
    sense = csma(min_exponent=0, max_exponent=1, **UNSLOTTED)
    bench = Bench(["a", "b"], rng_for=scripted(a=[], b=[1, 1]), mac="csma", csma=sense, **BYTE_PER_US)

    bench.run([(0, "a", 1), (second_ns, "b", 1)])

    assert bench.fate("a", 0, "b") is fate


@pytest.mark.parametrize(("slot_ns", "turnaround_ns"), [(320, 192), (100, 192), (100, 250)])
def test_two_nodes_that_start_together_collide_as_often_as_their_draws_say(slot_ns, turnaround_ns):
    windows, trials, period_ns = 8, 2000, 10**6
    sense = csma(scheme="unslotted", slot_ns=slot_ns, wait_ns=0, cca_ns=128, turnaround_ns=turnaround_ns,
                 min_exponent=3, max_exponent=5, max_attempts=5)
    bench = Bench(["a", "b", "hub"], mac="csma", csma=sense, topology=graph("a <-> b", "* -> hub"), **BYTE_PER_US)

    bench.run([(trial * period_ns, sender, 5) for trial in range(trials) for sender in "ab"])

    collisions = sum(bench.fate("a", trial, "hub") is Fate.COLLIDED for trial in range(trials))
    p = sum(abs(i - j) * slot_ns <= turnaround_ns for i in range(windows) for j in range(windows)) / windows ** 2
    assert abs(collisions / trials - p) < STANDARD_ERRORS * sqrt(p * (1 - p) / trials)


# Carrier sense, DCF (IEEE 802.11)

DCF = {"scheme": "dcf", "slot_ns": 20, "wait_ns": 50, "cca_ns": 0, "turnaround_ns": 5, "min_exponent": 3,
       "max_exponent": 3}


def test_a_silent_channel_is_used_at_once():
    bench = Bench(["a", "b"], rng_for=scripted(a=[]), mac="csma", csma=csma(**DCF), **BYTE_PER_US)

    bench.run([(1000, "a", 1)])

    assert starts(bench) == [("a", 1005)]


def test_a_countdown_freezes_while_others_talk_and_goes_on_from_where_it_was():
    bench = Bench(["a", "b", "c"], rng_for=scripted(a=[], b=[3], c=[7]), mac="csma", csma=csma(**DCF), **BYTE_PER_US)

    bench.run([(0, "a", 1), (500, "b", 1), (500, "c", 1)])

    b_start_ns = 1005 + 50 + 3 * 20
    c_start_ns = b_start_ns + 1000 + 50 + (7 - 3) * 20
    assert starts(bench) == [("a", 5), ("b", b_start_ns), ("c", c_start_ns)]


def test_silence_shorter_than_difs_does_not_count_down():
    bench = Bench(["a", "b", "c"], rng_for=scripted(a=[], b=[], c=[2]), mac="csma", csma=csma(**DCF),
                  topology=graph("a -> c", "b -> c", "c -> a"), **BYTE_PER_US)     # a and b do not hear each other

    bench.run([(0, "a", 1), (500, "c", 1), (1035, "b", 1)])

    # a: 5 .. 1005, b: 1040 .. 2040: c hears 35 ns of silence between them
    assert starts(bench) == [("a", 5), ("b", 1040), ("c", 2040 + 50 + 2 * 20)]


def test_a_node_backs_off_between_its_own_frames():
    bench = Bench(["a", "b"], rng_for=scripted(a=[4]), mac="csma", csma=csma(**DCF), **BYTE_PER_US)

    bench.run([(0, "a", 1), (1, "a", 1)])

    assert starts(bench) == [("a", 5), ("a", 1005 + 50 + 4 * 20)]


@pytest.mark.parametrize("turnaround_ns", [0, 5])
def test_two_frozen_countdowns_end_together_as_often_as_equal_draws(turnaround_ns):
    trials, period_ns = 2000, 10**6
    bench = Bench(["a", "b", "c", "hub"], mac="csma", csma=csma(**DCF | {"turnaround_ns": turnaround_ns}),
                  topology=graph("* <-> *"), **BYTE_PER_US)

    bench.run([offer for trial in range(trials) for offer in (
        (trial * period_ns, "a", 5), (trial * period_ns + 1000, "b", 5), (trial * period_ns + 2000, "c", 5))])

    collisions = sum(bench.fate("b", trial, "hub") is Fate.COLLIDED for trial in range(trials))
    assert abs(collisions / trials - 1 / 8) < STANDARD_ERRORS * sqrt(1 / 8 * 7 / 8 / trials)


def round_chain(window):
    """Two nodes that always have a frame, from one transmission to the next. State: slots that the one who did not
    transmit has left; 0 if both did, that is, collided."""
    chain = np.zeros((window, window))
    for fresh in range(window):
        for left in range(1, window):
            chain[left, abs(fresh - left)] += 1 / window
        for other in range(window):
            chain[0, abs(fresh - other)] += 1 / window ** 2
    return chain


@pytest.mark.parametrize("exponent", [1, 2, 4])
def test_two_nodes_that_always_have_a_frame_collide_as_their_markov_chain_says(exponent):
    frames = 2000
    sense = csma(**{**DCF, "min_exponent": exponent, "max_exponent": exponent})
    bench = Bench(["a", "b", "hub"], mac="csma", csma=sense, queue_frames=frames, topology=graph("* <-> *"),
                  **BYTE_PER_US)

    bench.run([(0, sender, 5) for _ in range(frames) for sender in "ab"])

    last = {sender: max(start for node, start in starts(bench) if node == sender) for sender in "ab"}
    rounds = sorted(start for _, start in starts(bench) if 5 < start < min(last.values()))      # both had frames
    collided = len(rounds) - len(set(rounds))
    chain = round_chain(2 ** exponent)
    stationary = np.linalg.matrix_power(chain, 2000)[0]
    p = stationary[0]
    fundamental = np.linalg.inv(np.eye(len(chain)) - chain + stationary)
    sigma = sqrt((2 * p * fundamental[0, 0] - p - p * p) / len(set(rounds)))
    assert abs(collided / len(set(rounds)) - p) < STANDARD_ERRORS * sigma


# What listening is good for, and what it cannot do

@pytest.mark.parametrize("preset", [name for name in PRESETS if name != "ideal"])
def test_carrier_sense_collides_less_than_aloha_on_the_same_traffic(preset):
    nodes = [f"n{k}" for k in range(20)]
    airtime_ns = PRESETS[preset].airtime_ns(60)
    lost = {}
    for mac in ("aloha", "csma"):
        bench = Bench([*nodes, "hub"], preset=preset, mac=mac, queue_frames=100)
        bench.run(poisson_arrivals(random.Random(preset), 0.3, airtime_ns, 600, 60))
        lost[mac] = sum(bench.fate(sender, number, "hub") is Fate.COLLIDED for sender, number, _, _ in bench.flights)

    sigma = sqrt(600 * exp(-0.6) * (1 - exp(-0.6)))
    assert lost["csma"] < lost["aloha"] - STANDARD_ERRORS * sigma


def test_listening_does_not_help_a_radio_whose_turnaround_outlasts_its_frames():
    airtime_ns = PRESETS["crazyflie_p2p"].airtime_ns(0)
    assert airtime_ns < PRESETS["crazyflie_p2p"].csma.turnaround_ns
    sense = csma(min_exponent=0, max_exponent=0, max_attempts=5)
    bench = Bench(["a", "b", "hub"], preset="crazyflie_p2p", mac="csma", csma=sense, topology=graph("* <-> *"))

    bench.run([(0, "a", 0), (airtime_ns - 1, "b", 0)])

    assert bench.fate("a", 0, "hub") is Fate.COLLIDED


@pytest.mark.parametrize("scheme", [UNSLOTTED | {"min_exponent": 0, "max_exponent": 0}, DCF])
def test_hidden_nodes_collide_although_they_listen(scheme):
    bench = Bench(["a", "b", "c"], mac="csma", csma=csma(**scheme), topology=graph("a <-> b", "b <-> c"), **BYTE_PER_US)

    bench.run([(1000, "a", 1), (1500, "c", 1)])

    assert bench.fate("a", 0, "b") is Fate.COLLIDED
    assert bench.fate("c", 0, "b") is Fate.COLLIDED


@pytest.mark.parametrize("scheme", [UNSLOTTED | {"min_exponent": 3, "max_exponent": 5}, DCF])
def test_exposed_nodes_wait_for_each_other_although_they_need_not(scheme):
    bench = Bench(["a", "b", "c", "d"], mac="csma", csma=csma(**scheme),
                  topology=graph("b <-> c", "b -> a", "c -> d"), **BYTE_PER_US)

    bench.run([(10_000, "b", 1), (11_000, "c", 1)])

    (_, _, _, b_end_ns), (_, _, c_start_ns, _) = bench.flights
    assert c_start_ns >= b_end_ns
    assert bench.fate("b", 0, "c") is Fate.DELIVERED
