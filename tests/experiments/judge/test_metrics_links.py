"""Age of information and losses against brute force on a grid and cases worked out by hand."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.judge.frame_copies import FrameCopies
from experiments.judge.link_metrics import (
    LinkAges,
    age_of_information,
    age_quantiles,
    successive_losses,
    times_between_transmissions,
    transmissions,
)
from netem.records.ledger import Row
from tests.examples import examples

MS = 1_000_000


def ledger(*rows: tuple[str, str, int, int, int, str]) -> FrameCopies:
    """Rows of (sender, receiver, number, offered_ms, delivered_ms, fate) on the radio; airtime 1 ms from the offer."""
    closed: list[Row] = [("radio", sender, number, receiver, 0, offered * MS, offered * MS, (offered + 1) * MS,
                          delivered * MS if delivered >= 0 else -1, 10, b"", fate, "")
                         for sender, receiver, number, offered, delivered, fate in rows]
    return FrameCopies.of_rows(closed)


def only(ages: LinkAges, figure: str) -> float:
    (value,) = getattr(ages, figure)
    return float(value)


def test_one_delivery_half_way_makes_two_teeth() -> None:
    # ages: 0 -> 0.5 s on [0, 0.5), then handed out at 0.4: 0.1 -> 0.6 s on [0.5, 1)
    table = age_of_information(ledger(("a", "b", 0, 400, 500, "delivered")), 1000 * MS)

    assert only(table, "max_s") == pytest.approx(0.6)
    assert only(table, "mean_s") == pytest.approx(0.5 * 0.25 + 0.5 * 0.35)


def test_a_link_that_never_delivers_has_the_age_of_the_run() -> None:
    table = age_of_information(ledger(("a", "b", 0, 400, -1, "collided")), 1000 * MS)

    assert (only(table, "max_s"), only(table, "mean_s")) == pytest.approx((1.0, 0.5))


def test_a_late_frame_behind_a_newer_one_does_not_lower_the_age() -> None:
    newer_first = ledger(("a", "b", 1, 300, 400, "delivered"), ("a", "b", 0, 100, 600, "delivered"))
    newer_only = ledger(("a", "b", 1, 300, 400, "delivered"))

    first, second = (age_of_information(rows, 1000 * MS) for rows in (newer_first, newer_only))
    assert only(first, "mean_s") == pytest.approx(only(second, "mean_s"), rel=1e-12)
    assert only(first, "max_s") == only(second, "max_s")


def test_corrupt_frames_do_not_inform_and_weak_links_do_not_count() -> None:
    rows = ledger(("a", "b", 0, 100, 200, "delivered corrupt"), ("a", "c", 0, 100, -1, "too weak"))

    table = age_of_information(rows, 1000 * MS)

    assert table.links == [("radio", "a", "b")]
    assert only(table, "max_s") == 1.0


def test_a_periodic_lossless_link_has_the_closed_form_age() -> None:
    # period T, delay D: the age runs from D to T + D, so its mean is D + T/2 (Kaul, Yates, Gruteser 2012)
    period, delay, frames = 20, 5, 500
    rows = ledger(*[("a", "b", k, k * period, k * period + delay, "delivered") for k in range(frames)])

    table = age_of_information(rows, frames * period * MS)

    start_up_s = delay * delay / 2 * 1e-6 - delay * (period + delay / 2) * 1e-6     # [0, D) differs from a full tooth
    expected = (delay + period / 2) * 1e-3 + start_up_s / (frames * period * 1e-3)
    assert only(table, "mean_s") == pytest.approx(expected, rel=1e-9)
    assert only(table, "max_s") == pytest.approx((period + delay) * 1e-3)


def brute_force(deliveries: list[tuple[int, int]], length_ms: int) -> np.ndarray:
    """Age [ms] at the middle of every millisecond, by looking at all deliveries each time."""
    return np.array([t - max([0] + [offered for offered, delivered in deliveries if delivered <= t])
                     for t in np.arange(length_ms) + 0.5])


@given(st.integers(0, 2**32), st.integers(1, 40))
@settings(max_examples=examples(40), deadline=None)
def test_the_exact_integral_agrees_with_brute_force_on_a_grid(seed: int, frames: int) -> None:
    draw = Random(seed)
    length_ms = 300
    offered = [draw.randrange(length_ms) for _ in range(frames)]
    deliveries = [(time, time + draw.randrange(1, 60)) for time in offered]
    rows = ledger(*[("a", "b", k, *pair, "delivered") for k, pair in enumerate(deliveries)])

    table = age_of_information(rows, length_ms * MS)

    # all instants are whole milliseconds and the age is linear between, so the midpoint rule is exact
    ages = brute_force(deliveries, length_ms)
    assert only(table, "mean_s") == pytest.approx(ages.mean() * 1e-3, rel=1e-9)
    assert only(table, "max_s") == pytest.approx((ages.max() + 0.5) * 1e-3, rel=1e-9)
    shares = [0.05, 0.5, 0.95]
    quantiles, = age_quantiles(rows, length_ms * MS, table.links, shares).values()
    for share, quantile in zip(shares, quantiles, strict=True):
        on_grid = np.quantile(ages, share, method="inverted_cdf") * 1e-3
        assert abs(quantile - on_grid) <= 0.5e-3 + 1e-12       # half a cell of the grid


DAY_NS = 86_400 * 10**9
INSTANTS = st.integers(0, DAY_NS - 1)


@given(st.lists(st.tuples(INSTANTS, st.integers(1, DAY_NS)), max_size=40), st.integers(DAY_NS // 2, DAY_NS))
@settings(max_examples=examples(200), deadline=None)
def test_over_a_day_at_nanoseconds_the_mean_age_is_that_of_exact_fractions(frames: list[tuple[int, int]],
                                                                          length_ns: int) -> None:
    deliveries = [(offered, offered + takes) for offered, takes in frames]

    table = age_of_information(ledger_ns(deliveries), length_ns)

    mean_ns, max_ns = exact_ages(deliveries, length_ns)
    # each piece is wrong by a few roundings of float64, and so is the sum of n of them
    assert abs(Fraction(only(table, "mean_s")) - mean_ns / 10**9) <= mean_ns / 10**9 * (len(frames) + 8) / 2**53
    assert only(table, "max_s") == max_ns / 1e9
    assert 0 <= only(table, "mean_s") <= only(table, "max_s")
    low, high = age_quantiles(ledger_ns(deliveries), length_ns, table.links, [0.0, 1.0])[table.links[0]]
    assert 0 <= low <= only(table, "mean_s") * (1 + 1e-12)
    assert high == only(table, "max_s")


def ledger_ns(deliveries: list[tuple[int, int]]) -> FrameCopies:
    """A link that also lost a frame, so that it is there without deliveries; (offered_ns, delivered_ns)."""
    rows: list[Row] = [("radio", "a", 0, "b", 0, 0, 0, 1, -1, 10, b"", "lost", "")]
    rows += [("radio", "a", number, "b", 0, offered, offered, offered + 1, delivered, 10, b"", "delivered", "")
             for number, (offered, delivered) in enumerate(deliveries, 1)]
    return FrameCopies.of_rows(rows)


def exact_ages(deliveries: list[tuple[int, int]], length_ns: int) -> tuple[Fraction, int]:
    """Mean and largest age [ns] in Python's integers: the area under the sawtooth, piece by piece."""
    edges = sorted({0, length_ns, *(delivered for _, delivered in deliveries if delivered < length_ns)})
    area, largest = Fraction(0), 0
    for start, end in pairwise(edges):
        newest = max([0, *(offered for offered, delivered in deliveries if delivered <= start)])
        area += Fraction((end - start) * ((start - newest) + (end - newest)), 2)
        largest = max(largest, end - newest)
    return area / length_ns, largest


def test_links_are_kept_apart() -> None:
    rows = ledger(("a", "b", 0, 400, 500, "delivered"), ("b", "a", 0, 400, -1, "lost"),
                  ("a", "c", 0, 400, 900, "delivered"))

    table = age_of_information(rows, 1000 * MS)

    assert table.max_s.tolist() == pytest.approx([0.6, 0.9, 1.0])


def test_the_longest_row_of_losses_is_counted_per_link_and_in_frame_order() -> None:
    def fates(receiver: str, *names: str) -> list[tuple[str, str, int, int, int, str]]:
        return [("a", receiver, number, number * 10, -1, name) for number, name in enumerate(names)]
    d, c, w = "delivered", "collided", "lost"
    rows = ledger(*reversed(fates("b", d, c, w, d, c, w, c, d)), *fates("c", c, d, c), *fates("e", d, d),
                  *fates("f", c, c, "unfinished"), *fates("g", w, w, w, w))

    longest = successive_losses(rows)

    assert {receiver: row for (_, _, receiver), row in longest.items()} == {"b": 3, "c": 1, "e": 0, "f": 2, "g": 4}


def test_a_frame_of_which_one_duplicate_arrives_is_not_lost() -> None:
    rows = ledger(("a", "b", 0, 0, -1, "lost"), ("a", "b", 0, 0, 3, "delivered"))

    assert successive_losses(rows) == {("radio", "a", "b"): 0}


def test_transmissions_are_counted_once_however_many_receivers_there_are() -> None:
    rows = ledger(("a", "b", 1, 30, 31, "delivered"), ("a", "c", 1, 30, -1, "lost"), ("a", "b", 0, 10, 11, "delivered"),
                  ("a", "c", 0, 10, 11, "delivered"), ("a", "b", 2, 35, 36, "delivered"),
                  ("b", "a", 0, 0, 1, "delivered"))

    assert transmissions(rows).on_air_ns.tolist() == [10 * MS, 30 * MS, 35 * MS, 0]
    assert times_between_transmissions(rows).gap_s.tolist() == pytest.approx([0.02, 0.005])


def test_nothing_on_the_air_gives_empty_tables() -> None:
    rows = ledger()

    assert age_of_information(rows, 1000 * MS).links == []
    assert age_quantiles(rows, 1000 * MS, [], [0.5]) == {}
    assert transmissions(rows).on_air_ns.size == 0
    assert successive_losses(rows) == {}
    assert times_between_transmissions(rows).gap_s.size == 0
