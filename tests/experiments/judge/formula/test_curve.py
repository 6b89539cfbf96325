"""Piecewise linear functions against brute force at every tenth of a nanosecond of a short time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.judge.formula import curve as curves
from experiments.judge.formula.curve import Curve, Floats, NotThatLong

LONG = 12                               # ns; breakpoints are whole ns, as the instants of a run
FINE = 40                               # instants of the brute force per ns
# Values are multiples of 1/4 and slopes at most 8/ns, so between two instants of the grid a function changes by 1/5.
SLACK = 8 / FINE


@st.composite
def functions(draw: st.DrawFn) -> Curve:
    """A function with jumps, constant and sloping pieces."""
    inner = draw(st.lists(st.integers(1, LONG - 1), unique=True, max_size=6))
    t = np.array([0, *sorted(inner), LONG], dtype=np.float64)
    value = st.integers(-16, 16).map(lambda quarter: quarter / 4)
    first = np.array([draw(value) for _ in t[1:]])
    last = np.array([draw(value) if draw(st.booleans()) else start for start in first])
    return Curve(t, first, last)


def grid(end: float) -> Floats:
    return np.arange(0, round(end * FINE)) / FINE


def sampled(curve: Curve, at: Floats) -> Floats:
    k = np.clip(np.searchsorted(curve.t, at, side="right") - 1, 0, curve.first.size - 1)
    share = (at - curve.t[k]) / (curve.t[k + 1] - curve.t[k])
    return (1 - share) * curve.first[k] + share * curve.last[k]


def near(found: Curve, expected: Callable[[int], float], every: int = 1) -> bool:
    """Whether a function is the expected one at instant k / FINE for each k, within what a fine grid can miss."""
    k = np.arange(0, round(found.end * FINE), every)
    brute = np.array([expected(each) for each in k.tolist()])
    return bool(np.all(np.abs(sampled(found, k / FINE) - brute) <= SLACK + 1e-9))


@given(functions(), functions())
def test_the_smaller_of_two_functions_is_exact_at_every_instant(one: Curve, other: Curve) -> None:
    at = grid(LONG)

    found = curves.smaller(one, other)

    assert np.allclose(sampled(found, at), np.minimum(sampled(one, at), sampled(other, at)), atol=1e-12)


@given(functions())
def test_the_absolute_value_is_exact_at_every_instant(one: Curve) -> None:
    at = grid(LONG)

    assert np.allclose(sampled(curves.absolute(one), at), np.abs(sampled(one, at)), atol=1e-12)


@given(functions(), functions())
def test_sums_are_exact_at_every_instant(one: Curve, other: Curve) -> None:
    at = grid(LONG)

    assert np.allclose(sampled(curves.plus(one, other), at), sampled(one, at) + sampled(other, at), atol=1e-12)


@given(functions(), st.integers(0, 4), st.one_of(st.none(), st.integers(0, 4)))
def test_the_supremum_over_a_window_is_that_of_a_fine_grid(one: Curve, start: int, more: int | None) -> None:
    at = grid(LONG)
    values = sampled(one, at)
    stop = None if more is None else start + more

    found = curves.sup(one, start, stop)

    def brute(k: int) -> float:
        last = None if stop is None else k + stop * FINE + 1
        return float(values[k + start * FINE:last].max())

    assert near(found, brute)


@given(functions(), functions(), st.integers(0, 3), st.one_of(st.none(), st.integers(0, 4)))
def test_until_is_its_definition_on_a_fine_grid(hold: Curve, reach: Curve, start: int, more: int | None) -> None:
    at = grid(LONG)
    x, y = sampled(hold, at), sampled(reach, at)

    found = curves.until(hold, reach, start, None if more is None else start + more)

    def brute(k: int) -> float:
        first = k + start * FINE
        stop = at.size if more is None else first + more * FINE + 1
        must = x[k:first + 1].min() if start else np.inf
        best = [min(y[j], must, x[k:j].min(initial=np.inf)) for j in range(first, min(stop, at.size))]
        return float(max(best))

    assert near(found, brute, every=7)


@given(functions(), st.integers(0, 4), st.integers(0, 4))
def test_the_extremes_of_a_window_hold_its_supremum(one: Curve, start: int, more: int) -> None:
    found = curves.sup(one, start, start + more)

    for at in [0.0, *found.t.tolist()]:
        seen = curves.extremes(one, at + start, at + start + more, False)
        if at < found.end:
            assert seen.values.max() == pytest.approx(curves.value(found, at), abs=1e-12)


def test_the_peak_of_a_sawtooth_counts_though_the_age_has_fallen_at_the_next_instant() -> None:
    age = Curve(np.array([0.0, 4.0, 10.0]), np.array([0.0, 1.0]), np.array([4.0, 7.0]))

    assert curves.value(curves.sup(age, 0, 4), 0.0) == 4.0
    assert curves.value(curves.sup(age, 0, 3), 0.0) == 3.0


def test_a_window_beyond_the_end_is_refused() -> None:
    with pytest.raises(NotThatLong):
        curves.sup(curves.constant(1.0, 5.0), 0, 6)


@pytest.mark.parametrize("operation", [curves.smaller, curves.plus, lambda one, other: curves.until(one, other, 0, 1)])
def test_results_of_constant_pieces_keep_whole_breakpoints(operation: Callable[[Curve, Curve], Curve]) -> None:
    rng = np.random.default_rng(1)
    one, other = (curves.steps(np.arange(0, 1000, 10), rng.normal(size=100), 1000.0) for _ in range(2))

    found = operation(one, other)

    assert np.array_equal(found.t, np.round(found.t))
    assert np.array_equal(found.first, found.last)
