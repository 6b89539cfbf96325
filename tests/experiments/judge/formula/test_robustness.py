"""Robustness, the instant and the comparison that decide it, on runs small enough to work out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.judge.formula import curve as curves
from experiments.judge.formula.robustness import (
    FormulaError,
    NotMeasured,
    Robustness,
    over_time,
    robustness,
)
from netem.core.fate import Fate
from netem.records.events import Event
from tests.examples import examples
from tests.experiments.judge.formula.runs import MS, S, frames, run, signals
from tests.experiments.judge.formula.test_against_rtamt import COLUMN, NAMES, SAMPLES, Text, formulas

# Frames at 0, 100, 200, ... ms, each 1 ms on the air and 2 ms to its receiver; those of 300 and 400 ms are lost.
LINK = frames(*[(at, Fate.LOST, -1) if at in (300, 400) else (at, Fate.DELIVERED, at + 2)
                for at in range(0, 1000, 100)])
AGES = run(S, LINK, signals=signals("r2", "m", 100 * MS, error=[0.0, 0.0, 0.0, 0.1, 0.3, 0.5, 0.2, 0.05, 0.0, 0.0]))


def test_the_peak_of_an_age_is_that_just_before_the_next_arrival() -> None:
    found = robustness(AGES, "always(age(radio: r1 -> r2) < 0.25 s)")

    # the frame of 200 ms is the newest until that of 500 ms arrives at 502 ms
    assert found == Robustness(pytest.approx(-0.052), pytest.approx(0.502), "age(radio: r1 -> r2) < 0.25 s", "s", False)


def test_an_age_that_reaches_the_bound_only_when_it_falls_satisfies_it_with_no_margin() -> None:
    assert robustness(AGES, "always age(radio: r1 -> r2) < 302 ms") == Robustness(
        0.0, 0.502, "age(radio: r1 -> r2) < 302 ms", "s", True)


def test_the_formula_of_the_issue() -> None:
    found = robustness(AGES, "always[0, 0.4 s](age(radio: r1 -> r2) > 250 ms implies "
                             "eventually[0, 0.5 s] abs(r2.error) < 0.1 m)")

    # the age is above 250 ms from 450 ms on; until 400 ms the antecedent is false, by 250 - 200 ms at least
    assert found.satisfied
    assert found.value == pytest.approx(0.1)            # 0.05 if the left side decided; within 0.5 s the error is 0
    assert found.time_s == pytest.approx(0.35)          # where both sides come to that, so either decides


def test_counts_are_exact_at_the_instants_at_which_copies_end() -> None:
    assert robustness(AGES, "eventually[401 ms, 401 ms] count(lost, radio: r1 -> r2) == 2").satisfied
    assert not robustness(AGES, "eventually[400.999999 ms, 400.999999 ms] count(lost, radio: r1 -> r2) == 2").satisfied
    assert robustness(AGES, "always count(lost, radio: * -> *) <= 2") == Robustness(
        0.0, 0.401, "count(lost, radio: * -> *) <= 2", "", True)
    assert not robustness(AGES, "always count(lost, radio: * -> *) < 2").satisfied
    assert robustness(AGES, "eventually(count(offered, radio: r1 -> r2) >= 10)").time_s == 0.9
    assert robustness(AGES, "always count(not delivered, radio: r1 -> r2) < 3").value == 1.0


def test_a_link_that_is_named_and_silent_ages_with_time() -> None:
    found = robustness(run(S, LINK, scenario={"media": {"radio": {"nodes": ["r1", "r2", "r3"]}}}),
                       "always age(radio: r3 -> r1) < 0.4 s")

    assert (found.value, found.time_s) == (pytest.approx(-0.6), 1.0)


def test_the_oldest_of_several_links_counts() -> None:
    both = run(S, LINK, scenario={"media": {"radio": {"nodes": ["r1", "r2", "r3"]}}})
    links = {"radio: * -> *": [("radio", "r1", "r2"), ("radio", "r3", "r2")]}

    found = robustness(both, "always age(radio: * -> *) < 2 s", links)
    assert (found.value, found.time_s, found.subjects) == (pytest.approx(1.0), 1.0, ("radio: r3 -> r2",))
    assert robustness(both, "always age(radio: * -> *) < 2 s").value == pytest.approx(2 - 0.302)   # links of the ledger


def test_units_are_converted_and_the_number_is_exact() -> None:
    data = run(2 * S, signals={**signals("a", "ms", x=[50.0, 50.0]), **signals("b", "deg", w=[180.0, 180.0])})

    assert robustness(data, "a.x <= 0.05 s").value == 0.0
    assert robustness(data, "b.w > 3 rad").value == pytest.approx(np.pi - 3)
    with pytest.raises(FormulaError, match=r"units do not match: a.x is in s and 3 m is in m"):
        robustness(data, "a.x < 3 m")


def test_a_pattern_is_an_argument_of_min_and_max() -> None:
    data = run(3 * S, signals={**signals("r1", x=[1, 2, 3]), **signals("r2", x=[0, 4, 1]), **signals("q", x=[9, 9, 9])})

    assert robustness(data, "always max(r*.x) - min(r*.x) <= 2") == Robustness(
        0.0, 1.0, "max(r*.x) - min(r*.x) <= 2", "", True, ("r2.x", "r1.x"))
    assert robustness(data, "always min(r1.x, 2, q.x) >= 1").value == 0.0


def test_events_and_counters() -> None:
    events = [Event(1 * S, "r1", "gain product", "0.9"), Event(2 * S, "r1", "gain product", "0.8")]
    data = run(4 * S, events=events, counters={"r1": {"slots missed": 3}, "r2": {"slots missed": 4}})

    assert robustness(data, "eventually[0, 2 s] events('r*.gain product') == 2").time_s == 2.0
    assert robustness(data, "counter('r*.slots missed') <= 7").satisfied
    with pytest.raises(NotMeasured, match="has a counter 'slots'"):
        robustness(data, "counter(r1.slots) <= 7")


@pytest.mark.parametrize(("formula", "why"), [
    ("always[0, 20 s] r2.error < 1 m", "it looks 20 s ahead, and the run ended at 1 s"),
    ("always 1 / r2.error < 3 1/m", "it divides by 0"),
    ("always r2.error / r2.error < 3", "it divides by 0"),
])
def test_what_cannot_be_measured_says_why(formula: str, why: str) -> None:
    with pytest.raises(NotMeasured, match=why):
        robustness(AGES, formula)


def test_a_signal_that_is_not_a_number_is_told_with_its_instant() -> None:
    with pytest.raises(NotMeasured, match=r"r1.x is not a number at 1 s"):
        robustness(run(3 * S, signals=signals("r1", x=[0, np.nan, 1])), "always r1.x < 3")


def test_signals_at_irregular_instants_hold_until_the_next() -> None:
    table = signals("r1", x=[5, 1, 3])["r1"]
    data = run(10 * S, signals={"r1": type(table)("r1", ("x",), ("1",), np.array([0, 1, 7]) * S, table.values)})

    assert robustness(data, "always[1 s, 6.999999999 s] r1.x <= 1").satisfied
    assert not robustness(data, "always[1 s, 7 s] r1.x <= 1").satisfied


def test_robustness_over_time_is_that_of_each_instant() -> None:
    found = over_time(AGES, "eventually[0, 100 ms] r2.error <= 0.2 m")

    assert found.curve.end == 900 * MS
    assert curves.value(found.curve, 450.0 * MS) == pytest.approx(-0.1)       # 0.3 and 0.5 are in the window


@settings(max_examples=examples(200), deadline=None)
@given(formulas(2), st.fixed_dictionaries(dict.fromkeys(NAMES, COLUMN)))
def test_the_comparison_that_decides_has_that_robustness_at_that_instant(formula: Text,
                                                                         columns: dict[str, list[float]]) -> None:
    data = run(SAMPLES * S, signals=signals("r", **columns))

    found = robustness(data, formula.ours)

    alone = over_time(data, found.predicate)
    there = {abs(curves.value(alone.curve, found.time_s * S, below)) for below in (False, True)}
    assert any(value == pytest.approx(abs(found.value), abs=1e-12) for value in there)
