"""The histogram of lateness against the sorted list of the same numbers."""

from __future__ import annotations

from math import ceil

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netem.gateways.lateness import Lateness

WIDTH = 1 / 32          # of a bucket, relative to its lower bound


@given(st.lists(st.integers(0, 10**15), min_size=1), st.floats(0, 1))
def test_a_quantile_is_the_sorted_lists_and_at_most_a_bucket_above_it(late_ns: list[int], ratio: float) -> None:
    lateness = Lateness()
    for value_ns in late_ns:
        lateness.add(value_ns)

    found_ns = lateness.quantile_ns(ratio)

    exact_ns = sorted(late_ns)[max(0, ceil(ratio * len(late_ns)) - 1)]
    assert exact_ns <= found_ns <= exact_ns * (1 + WIDTH)
    assert found_ns <= lateness.worst_ns == max(late_ns)


def test_its_size_does_not_grow_with_the_run() -> None:
    lateness = Lateness()

    for k in range(100_000):
        lateness.add(k * 7919 % 10**9)

    assert lateness.events == 100_000
    assert len(lateness.buckets) <= 32 * 30         # 30 doublings up to a second


def test_an_event_that_happens_early_is_refused() -> None:
    with pytest.raises(ValueError, match="late_ns=-1: an event of a run in real time never happens early"):
        Lateness().add(-1)
