from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netem.core.fate import Fate
from netem.core.random_streams import stream
from netem.core.transit import Transit
from netem.impairments.bernoulli_loss import BernoulliLoss
from netem.impairments.rate_limit import RateLimit
from netem.impairments.window import Window


def blackout(during_ns):
    return Window(BernoulliLoss(1.0, rng=stream(7, "loss")), during_ns)


@settings(deadline=None)
@given(st.lists(st.integers(0, 60), min_size=2, max_size=12, unique=True))
def test_it_acts_exactly_inside_its_half_open_intervals(edges):
    edges = sorted(edges[:len(edges) // 2 * 2])
    intervals = list(zip(edges[::2], edges[1::2], strict=True))
    window = blackout(list(reversed(intervals)))

    for at_ns in range(62):
        lost = not list(window.carry(Transit(0, at_ns, at_ns, b"")))
        assert lost == any(start <= at_ns < end for start, end in intervals)


def test_intervals_may_touch():
    window = blackout([(10, 20), (20, 30)])

    lost = [at_ns for at_ns in range(40) if not list(window.carry(Transit(0, at_ns, at_ns, b"")))]

    assert lost == list(range(10, 30))


def test_one_interval_may_stand_without_its_list():
    assert blackout([10, 20]).during_ns == [(10, 20)]


def test_entry_into_the_link_counts_not_arrival():
    window = blackout([(10, 20)])

    assert not list(window.carry(Transit(0, 15, 99, b"")))
    assert list(window.carry(Transit(0, 5, 15, b"")))


def test_it_loses_under_the_fate_of_what_it_holds():
    assert Window(RateLimit(9600), [(0, 1)]).loses_as is Fate.QUEUE_FULL


@pytest.mark.parametrize(("during_ns", "message"), [
    ([], r"during_ns=\[\]: expected at least one interval"),
    ([(5, 5)], r"during_ns=\(5, 5\): expected \[start, end\) with 0 <= start < end"),
    ([(-1, 5)], "with 0 <= start < end"),
    ([(1, 2, 3)], "with 0 <= start < end"),
    ([1, 2, 3], "with 0 <= start < end"),
    ([(10, 20), (0, 11)], r"during_ns=\[\(0, 11\), \(10, 20\)\]: intervals overlap: merge them"),
])
def test_nonsense_is_refused_with_value_and_rule(during_ns, message):
    with pytest.raises(ValueError, match=message):
        blackout(during_ns)
