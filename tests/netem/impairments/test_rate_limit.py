from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from math import ceil

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments.rate_limit import RateLimit
from tests.examples import examples

# At 8 Mbit/s a byte takes 1 us: gaps of whole microseconds let arrivals meet starts and ends of sending exactly.
rates_bps = st.just(8_000_000) | st.integers(3_000_000, 30_000_000)
arrivals = st.lists(st.tuples(st.integers(0, 30).map(lambda us: us * 1000), st.integers(0, 30)), max_size=40)


def brute_force(link, rate_bps, overhead_bytes, queue_frames, queue_bytes, queue_ns):
    """Lindley's recursion over all accepted frames, and at each arrival a fresh count of those still waiting."""
    accepted, ends = [], []
    for arrival_ns, size in link:
        size += overhead_bytes
        start_ns = max([arrival_ns] + [end_ns for _, end_ns, _ in accepted])
        waiting = [bytes_ for begun_ns, _, bytes_ in accepted if begun_ns > arrival_ns]
        full = len(waiting) + 1 > queue_frames or (queue_bytes is not None and sum(waiting) + size > queue_bytes)
        full = full or (queue_ns is not None and start_ns - arrival_ns > queue_ns)
        if start_ns > arrival_ns and full:
            ends.append(None)
            continue
        end_ns = start_ns + ceil(Fraction(8 * size * 10 ** 9, rate_bps))
        accepted.append((start_ns, end_ns, size))
        ends.append(end_ns)
    return ends


@settings(max_examples=examples(400), deadline=None)
@given(arrivals, rates_bps, st.integers(0, 8), st.integers(0, 5), st.none() | st.integers(0, 90),
       st.none() | st.integers(0, 60).map(lambda us: us * 1000))
def test_departures_and_drops_match_a_brute_force_queue(gaps, rate_bps, overhead_bytes, queue_frames, queue_bytes,
                                                        queue_ns):
    link, now_ns = [], 0
    for gap_ns, size in gaps:
        now_ns += gap_ns
        link.append((now_ns, size))
    limit = RateLimit(rate_bps, overhead_bytes, queue_frames, queue_bytes, queue_ns)

    out = [list(limit.carry(Transit(n, at_ns, at_ns, bytes(size)))) for n, (at_ns, size) in enumerate(link)]

    ends = [copies[0].arrival_ns if copies else None for copies in out]
    assert ends == brute_force(link, rate_bps, overhead_bytes, queue_frames, queue_bytes, queue_ns)


def test_a_saturated_link_passes_its_rate(frames):
    limit = RateLimit(rate_bps=80_000, queue_frames=5)      # 10 bytes take 1 ms, one comes every 0.4 ms

    out = [copy.arrival_ns for transit in frames(500, every_ns=400_000) for copy in limit.carry(transit)]

    assert {b - a for a, b in pairwise(out)} == {1_000_000}
    assert out[-1] - 499 * 400_000 <= 6_000_000             # at most the one being sent and five that wait
    assert len(out) == 1 + 499 * 400_000 // 1_000_000 + 5


def test_a_frame_finds_the_link_free_at_the_very_instant_the_one_before_has_passed(frames):
    limit = RateLimit(rate_bps=80_000, queue_frames=0)      # 10 bytes take 1 ms and one comes every 1 ms

    assert all(list(limit.carry(transit)) for transit in frames(50, every_ns=1_000_000))


def test_a_full_queue_drops_the_newcomer_under_its_own_fate(frames):
    limit = RateLimit(rate_bps=80_000, queue_frames=1)

    passed = [transit.number for transit in frames(4, every_ns=1) if list(limit.carry(transit))]

    assert passed == [0, 1]
    assert limit.loses_as is Fate.QUEUE_FULL


@pytest.mark.parametrize(("wrong", "message"), [
    ({"rate_bps": 0}, "rate_bps=0: expected rate_bps >= 1"),
    ({"rate_bps": 1, "overhead_bytes": -14}, "overhead_bytes=-14: expected overhead_bytes >= 0"),
    ({"rate_bps": 1, "queue_frames": -1}, "queue_frames=-1: expected queue_frames >= 0"),
    ({"rate_bps": 1, "queue_bytes": -1}, "queue_bytes=-1: expected queue_bytes >= 0"),
])
def test_nonsense_is_refused_with_value_and_rule(wrong, message):
    with pytest.raises(ValueError, match=message):
        RateLimit(**wrong)
