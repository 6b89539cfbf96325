"""Decode rules against a brute-force oracle that goes through every pair of frames and every instant."""

import random
from math import log10

import pytest

from netem.core.fate import Fate
from tests.netem.media.radio_bench import BYTE_PER_US, US, Bench, graph

NODES = ["a", "b", "c", "d", "e"]
SENSITIVITY_DBM = -90.0
CAPTURE_DB = 6.0


def random_levels(rng, density):
    """Received power by (sender, receiver): a random directed graph, a few of its links below the sensitivity."""
    return {(sender, receiver): rng.uniform(-94, -40) for sender in NODES for receiver in NODES
            if sender != receiver and rng.random() < density}


def on_bench(rule, levels, offers, **settings):
    topology = graph(*(f"{sender} -> {receiver}" for sender, receiver in levels),
                     levels_dbm={f"{sender} -> {receiver}": level for (sender, receiver), level in levels.items()})
    bench = Bench(NODES, topology=topology, decode=rule, capture_db=CAPTURE_DB, sensitivity_dbm=SENSITIVITY_DBM,
                  **BYTE_PER_US, **settings)
    return bench.run(offers)


def expected_fate(rule, levels, flights, wanted, receiver):
    """From first principles: look at every nanosecond at which anything on the air changes."""
    sender, start_ns, end_ns = wanted
    rivals = [flight for flight in flights if flight != wanted and flight[1] < end_ns and start_ns < flight[2]]
    weak = levels[sender, receiver] < SENSITIVITY_DBM
    if rule == "local":
        return Fate.TOO_WEAK if weak else Fate.DELIVERED
    if any(rival[0] == receiver for rival in rivals):
        return Fate.DEAF
    if weak:
        return Fate.TOO_WEAK
    if rule == "radio_network":
        disturbed = any(levels.get((rival[0], receiver), -200) >= SENSITIVITY_DBM for rival in rivals)
        return Fate.COLLIDED if disturbed else Fate.DELIVERED
    instants = {t for _, s, e in [wanted, *rivals] for t in (s, e - 1) if start_ns <= t < end_ns}
    for t in instants:
        noise_mw = sum(10 ** (levels[rival[0], receiver] / 10) for rival in rivals
                       if rival[1] <= t < rival[2] and (rival[0], receiver) in levels)
        if noise_mw and levels[sender, receiver] - 10 * log10(noise_mw) < CAPTURE_DB:
            return Fate.COLLIDED
    return Fate.DELIVERED


@pytest.mark.parametrize("rule", ["radio_network", "local", "capture"])
def test_random_traffic_ends_as_brute_force_says(rule):
    seen = set()
    for seed in range(150):
        rng = random.Random(f"{rule}/{seed}")
        levels = random_levels(rng, density=rng.uniform(0.3, 1))
        offers = [(rng.randrange(100) * US, rng.choice(NODES), rng.randrange(0, 15)) for _ in range(20)]

        bench = on_bench(rule, levels, offers)

        flights = {(sender, number): (sender, start_ns, end_ns) for sender, number, start_ns, end_ns in bench.flights
                   if end_ns > start_ns}
        for (sender, number, receiver), fates in bench.ledger.fates.items():
            assert len(fates) == 1
            if (sender, number) in flights:
                wanted = flights[sender, number]
                assert fates[0] is expected_fate(rule, levels, flights.values(), wanted, receiver), (seed, wanted)
                seen.add(fates[0])
    assert seen == {"radio_network": {Fate.DELIVERED, Fate.DEAF, Fate.TOO_WEAK, Fate.COLLIDED},
                    "capture": {Fate.DELIVERED, Fate.DEAF, Fate.TOO_WEAK, Fate.COLLIDED},
                    "local": {Fate.DELIVERED, Fate.TOO_WEAK}}[rule]


@pytest.mark.parametrize(("margin_db", "strong", "weak"), [
    (6.0, Fate.DELIVERED, Fate.COLLIDED),
    (5.9, Fate.COLLIDED, Fate.COLLIDED),
    (0.0, Fate.COLLIDED, Fate.COLLIDED),
])
def test_the_stronger_of_two_survives_by_the_capture_margin_or_more(margin_db, strong, weak):
    levels = {("a", "c"): -60.0, ("b", "c"): -60.0 - margin_db}

    bench = on_bench("capture", levels, [(0, "a", 10), (5 * US, "b", 10)])

    assert bench.fate("a", 0, "c") is strong
    assert bench.fate("b", 0, "c") is weak


def test_two_rivals_at_once_add_up_to_3_db_more():
    levels = {("a", "c"): -60.0, ("b", "c"): -67.0, ("d", "c"): -67.0}

    together = on_bench("capture", levels, [(0, "a", 10), (2 * US, "b", 4), (4 * US, "d", 4)])
    in_turn = on_bench("capture", levels, [(0, "a", 10), (2 * US, "b", 3), (5 * US, "d", 3)])

    assert together.fate("a", 0, "c") is Fate.COLLIDED      # -67 and -67 make -64.0 dBm: only 4 dB below
    assert in_turn.fate("a", 0, "c") is Fate.DELIVERED


def test_a_rival_too_weak_to_be_decoded_still_disturbs_under_capture():
    levels = {("a", "c"): -88.0, ("b", "c"): -93.0}

    bench = on_bench("capture", levels, [(0, "a", 10), (5 * US, "b", 10)])

    assert bench.fate("a", 0, "c") is Fate.COLLIDED
    assert bench.fate("b", 0, "c") is Fate.TOO_WEAK
