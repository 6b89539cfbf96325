"""Robustness is that of rtamt, for formulas and signals that hypothesis makes up.

rtamt judges samples at whole seconds; between samples our signals stay as they are, so both mean the same. A bounded
`until` of ours asks its left side to hold up to the start of the interval, closed: `always[0, a]` says that to rtamt.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from experiments.judge.formula.robustness import robustness
from tests.examples import examples
from tests.experiments.judge.formula.runs import S, run, signals
from tests.oracles import rtamt

NAMES = ("x", "y", "z")
LONGEST = 3                             # s, of a window
DEEPEST = 3                             # windows within each other
SAMPLES = LONGEST * DEEPEST + 6


@dataclass(frozen=True)
class Text:
    """One formula in both languages; in ours the signals are of node `r`."""

    ours: str
    theirs: str


def constants() -> st.SearchStrategy[Text]:
    return st.integers(-8, 8).map(lambda number: Text(f"{number / 4}", f"({number / 4})"))


def values() -> st.SearchStrategy[Text]:
    one = st.sampled_from(NAMES).map(lambda name: Text(f"r.{name}", name))
    return st.recursive(one | constants(), lambda inner: st.one_of(
        st.builds(lambda a, op, b: Text(f"({a.ours} {op} {b.ours})", f"({a.theirs} {op} {b.theirs})"), inner,
                  st.sampled_from("+-*"), inner),
        inner.map(lambda a: Text(f"abs({a.ours})", f"abs({a.theirs})")),
    ), max_leaves=3)


def comparisons() -> st.SearchStrategy[Text]:
    return st.builds(lambda a, op, b: Text(f"{a.ours} {op} {b.ours}", f"({a.theirs} {op} {b.theirs})"), values(),
                     st.sampled_from(["<", "<=", ">", ">="]), values())


def windows() -> st.SearchStrategy[tuple[int, int]]:
    return st.tuples(st.integers(0, LONGEST), st.integers(0, LONGEST)).map(lambda ends: (min(ends), max(ends)))


def formulas(depth: int = DEEPEST) -> st.SearchStrategy[Text]:
    if depth == 0:
        return comparisons()
    inner = st.deferred(lambda: formulas(depth - 1))

    def both(a: Text, word: str, b: Text) -> Text:
        return Text(f"(({a.ours}) {word} ({b.ours}))", f"(({a.theirs}) {word} ({b.theirs}))")

    def window(word: str, ends: tuple[int, int], a: Text) -> Text:
        return Text(f"{word}[{ends[0]}, {ends[1]} s] ({a.ours})", f"({word}[{ends[0]},{ends[1]}] ({a.theirs}))")

    def until(a: Text, ends: tuple[int, int], b: Text) -> Text:
        between = f"(({a.theirs}) until[{ends[0]},{ends[1]}] ({b.theirs}))"
        start = f" and (always[0,{ends[0]}] ({a.theirs}))" if ends[0] else ""
        return Text(f"(({a.ours}) until[{ends[0]}, {ends[1]} s] ({b.ours}))", f"({between}{start})")

    return st.one_of(
        comparisons(), inner.map(lambda a: Text(f"not ({a.ours})", f"(not ({a.theirs}))")),
        st.builds(both, inner, st.sampled_from(["and", "or", "implies"]), inner),
        st.builds(window, st.sampled_from(["always", "eventually"]), windows(), inner),
        st.builds(until, inner, windows(), inner))


def theirs(formula: str, columns: dict[str, list[float]]) -> float:
    oracle: Any = rtamt().StlDiscreteTimeSpecification()
    for name in columns:
        oracle.declare_var(name, "float")
    oracle.spec = formula
    oracle.parse()
    found = oracle.evaluate({"time": list(range(SAMPLES)), **columns})
    return float(found[0][1])


COLUMN = st.lists(st.integers(-16, 16).map(lambda quarter: quarter / 4), min_size=SAMPLES, max_size=SAMPLES)


@pytest.mark.filterwarnings("ignore")                           # antlr's of old escapes
@settings(max_examples=examples(150), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(formulas(), st.fixed_dictionaries(dict.fromkeys(NAMES, COLUMN)))
def test_robustness_is_that_of_rtamt(formula: Text, columns: dict[str, list[float]]) -> None:
    data = run(SAMPLES * S, signals=signals("r", **columns))

    found = robustness(data, formula.ours)

    assert found.value == pytest.approx(theirs(formula.theirs, columns), abs=1e-12)
    assert found.satisfied if found.value > 0 else found.value == 0 or not found.satisfied


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("word", ["always", "eventually", "until"])
@settings(max_examples=examples(60), deadline=None)
@given(comparisons(), comparisons(), st.fixed_dictionaries(dict.fromkeys(NAMES, COLUMN)))
def test_without_an_interval_the_run_is_judged_up_to_its_end(word: str, one: Text, other: Text,
                                                             columns: dict[str, list[float]]) -> None:
    ours, their = (f"({one.ours}) until ({other.ours})", f"({one.theirs}) until ({other.theirs})") if word == "until" \
        else (f"{word} ({one.ours})", f"{word} ({one.theirs})")
    data = run(SAMPLES * S, signals=signals("r", **columns))

    assert robustness(data, ours).value == pytest.approx(theirs(their, columns), abs=1e-12)
