from __future__ import annotations

from bisect import bisect_right
from math import exp, sqrt

import numpy as np
import pytest
from scipy import stats

from netem.core.random_streams import stream
from netem.core.transit import Transit
from netem.impairments.gilbert_elliott_by_time import GilbertElliottByTime

S, MS = 1_000_000_000, 1_000_000
SIGNIFICANCE = 1e-3
RUNS = 6_000


def fades(seed=7, **settings):
    return GilbertElliottByTime(**{"mean_good_ns": 8 * S, "mean_bad_ns": 2 * S, **settings},
                                rng=stream(seed, "uplink/fades"))


def lost(channel, instants_ns):
    return [not list(channel.carry(Transit(n, at_ns, at_ns, b""))) for n, at_ns in enumerate(instants_ns)]


def test_the_share_of_bad_is_that_of_the_closed_form_at_every_instant():
    for at_ns in (0, 1 * S, 100 * S):
        share = sum(fades(seed).bad_at(at_ns) for seed in range(RUNS)) / RUNS

        assert abs(share - 0.2) < 4 * sqrt(0.2 * 0.8 / RUNS)


@pytest.mark.parametrize("gap_s", [0.1, 1.0, 3.0])
def test_bad_after_bad_has_the_probability_of_the_closed_form(gap_s):
    after = []
    for seed in range(RUNS):
        channel = fades(seed)
        if channel.bad_at(5 * S):
            after.append(channel.bad_at(5 * S + round(gap_s * S)))

    p = 0.2 + 0.8 * exp(-gap_s * (1 / 8 + 1 / 2))
    assert abs(sum(after) / len(after) - p) < 4 * sqrt(p * (1 - p) / len(after))


@pytest.mark.slow
def test_stays_are_exponential_with_the_means_asked_for():
    channel, step_ns = fades(), 1 * MS
    states = np.array([channel.bad_at(k * step_ns) for k in range(10_000_000)])     # 10 000 s, about 1000 stays of each

    edges = np.flatnonzero(np.diff(states.astype(np.int8)))
    stays_s = np.diff(edges) * step_ns / S                                          # between two edges seen
    bad = stays_s[states[edges[:-1] + 1]]
    good = stays_s[~states[edges[:-1] + 1]]
    assert len(bad) > 800
    assert stats.kstest(bad, stats.expon(scale=2).cdf).pvalue > SIGNIFICANCE
    assert stats.kstest(good, stats.expon(scale=8).cdf).pvalue > SIGNIFICANCE


def test_the_rate_of_the_frames_does_not_change_the_state():
    fast, slow = fades(), fades()
    every = range(0, 2_000 * S, 10 * MS)

    heard = dict(zip(every, lost(fast, every), strict=True))

    assert {at_ns: heard[at_ns] for at_ns in every[::100]} == dict(zip(every[::100], lost(slow, every[::100]),
                                                                       strict=True))


@pytest.mark.slow
def test_frames_far_apart_and_slightly_out_of_order_see_the_same_states():
    instants = [k * 7 * MS for k in range(300_000)]                     # 2100 s of fades of 3 ms: some are forgotten
    one, other = (fades(mean_good_ns=2 * MS, mean_bad_ns=1 * MS) for _ in range(2))

    in_order = [one.bad_at(at_ns) for at_ns in instants]
    swapped = [at_ns for pair in zip(instants[1::2], instants[::2], strict=True) for at_ns in pair]
    there = dict(zip(swapped, [other.bad_at(at_ns) for at_ns in swapped], strict=True))

    assert in_order == [there[at_ns] for at_ns in instants]
    assert len(one._edges) < 100_000


def test_each_state_loses_its_share():
    channel, states = fades(loss_while_bad=0.7, loss_while_good=0.1), fades(loss_while_bad=0.7, loss_while_good=0.1)
    instants = range(0, 4_000 * S, 20 * MS)

    found = {bad: [gone for at_ns, gone in zip(instants, lost(channel, instants), strict=True)
                   if states.bad_at(at_ns) is bad] for bad in (False, True)}

    for bad, p in ((False, 0.1), (True, 0.7)):
        assert abs(sum(found[bad]) / len(found[bad]) - p) < 4 * sqrt(p * (1 - p) / len(found[bad]))


@pytest.mark.parametrize(("settings", "message"), [
    ({"mean_bad_ns": 0}, "mean_bad_ns=0: expected mean_bad_ns >= 1"),
    ({"mean_good_ns": 0}, "mean_good_ns=0: expected mean_good_ns >= 1"),
    ({"mean_good_ns": 500_000, "mean_bad_ns": 400_000},
     r"mean_bad_ns=400000: expected mean_good_ns \+ mean_bad_ns >= 1000000"),
    ({"loss_while_bad": 1.5}, "loss_while_bad=1.5: expected 0 <= loss_while_bad <= 1"),
    ({"loss_while_bad": 0.1, "loss_while_good": 0.2}, "loss_while_good=0.2: expected less than loss_while_bad"),
])
def test_nonsense_is_refused_with_value_and_rule(settings, message):
    with pytest.raises(ValueError, match=message):
        fades(**settings)


def test_edges_lie_between_the_states_that_they_part():
    channel = fades()
    channel.bad_at(1_000 * S)
    edges = list(channel._edges)

    for edge_ns in edges[:20]:
        assert channel.bad_at(edge_ns - 1) is not channel.bad_at(edge_ns)
    assert bisect_right(edges, 1_000 * S) < len(edges)
