"""A formula that cannot be judged is refused with its place, the line of the formula and a caret below the mistake."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from experiments.run.recorded_signals import refuse_unrecorded
from experiments.scenario import ScenarioError, load
from experiments.scenario.formula.parse import FormulaError, parse

WRONG = [       # formula, the words at which the caret stands, rule
    ("alwys(r1.y < 2)", "alwys", "did you mean always?"),
    ("always(r1.y < 2", "", "expected )"),
    ("always r1.y < 2 andd r2.y < 2", "andd", "'andd' is no unit; did you mean and?"),
    ("r1.y", "", "expected a comparison"),
    ("r1 < 2", "r1", "a signal is written r1.NAME"),
    ("r1.y < 2 mss", "mss", "'mss' is no unit; did you mean ms?"),
    ("always[2 s, 1 s] r1.y < 2", "[2 s", "an empty interval"),
    ("always[0, 2 m] r1.y < 2", "0, 2 m", "an interval is in time"),
    ("always[0, 3 s] r1.y < 2", "[0, 3 s]", "looks 3 s ahead, beyond the run of 2.5 s"),
    ("eventually[0, 2 s] always[0, 1 s] r1.y < 2", "[0, 2 s]", "looks 3 s ahead"),
    ("always r9.y < 2", "r9.y", "no node matches 'r9'; did you mean \"r2\"?"),
    ("always r*.y < 2", "r*.y", "write max(r*.y) or min(r*.y)"),
    ("always e.nrom < 2", "e.nrom", "e has no signal 'nrom'; did you mean \"norm\"?"),
    ("always e.norm < 2", "2", "units do not match: e.norm is in m and 2 is a plain number; write 2 m"),
    ("always e.norm + 3 s < 2 m", "3 s", "units do not match: e.norm is in m and 3 s is in s"),
    ("always age(radoi: r1 -> r2) < 1 s", "age", "nearest: 'radio'"),
    ("always age(radio: r1 -> r1) < 1 s", "age", "a link leads to another node"),
    ("always age(r1 -> r2) < 1 s", "r1 ->", '"medium: sender -> receiver"'),
    ("always age(radio: r1 -> r2) * age(radio: r2 -> r1) < 1 s2", "age(radio: r2", "not by each other"),
    ("always 1 s2 / age(radio: r1 -> r2) < 1 s", "age", "not by each other"),
    ("always count(lots, radio: r1 -> r2) < 3", "count", "there is no fate 'lots'; did you mean \"lost\"?"),
    ("always cost(enrgy) < 3 J", "cost", "there is no cost 'enrgy'; did you mean \"energy\"?"),
    ("always cost(energy.r9) < 3 J", "cost", "has no part for 'r9'"),
    ("always cost(energy) < 3 s", "3 s", "cost(energy) is in J and 3 s is in s"),
]
MORE = """
[derived.e]
function = "math:hypot"
of = ["r1.y", "r2.y"]
signals = { norm = "m" }
[costs.energy]
kind = "radio_energy"
on = "radio: *"
transmit_w = 0.1
"""


@pytest.fixture
def refusal(valid: str, write: Callable[[str], Path]) -> Callable[[str], str]:
    """What loading the valid scenario says with these lines at its end."""
    def load_with(lines: str) -> str:
        with pytest.raises(ScenarioError) as refused:
            load(write(f"{valid}\n{lines}\n{MORE}"))
        assert len(refused.value.problems) == 1
        return refused.value.problems[0]

    return load_with


@pytest.mark.parametrize(("formula", "at", "rule"), WRONG)
def test_the_caret_stands_below_the_mistake(formula: str, at: str, rule: str, refusal: Callable[[str], str]) -> None:
    problem = refusal(f'recovers = "{formula}"')

    column = formula.index(at) if at else len(formula)
    first, line, caret = problem.split("\n")
    assert first.startswith(f"few.toml: expect.recovers: column {column + 1}: ")
    assert rule in first
    assert line == f"    {formula}"
    assert caret == f"    {' ' * column}^"


def test_of_several_lines_that_of_the_mistake_is_shown(refusal: Callable[[str], str]) -> None:
    problem = refusal('recovers = """always(\n  r1.y < 2\n  and r2.y < )"""')

    assert problem.split("\n")[1:] == ["      and r2.y < )", "                 ^"]


@pytest.mark.parametrize(("lines", "words"), [
    ('recovers = ""', "expect.recovers: is empty"),
    ('recovers = { formula = "r1.y < 2", during_s = [0, 1] }', "a formula has its intervals in itself"),
    ('recovers = { formula = "r1.y < 2", min = 2, max = 1 }', "expected min <= max"),
    ('delivery_ratio = "r1.y < 2"', "names a figure"),
    ('"cost.enrgy" = { max = 1 }', "there is no cost 'enrgy'; nearest: cost.energy"),
    ('"cost.energy.r3" = { max = 1 }', "costs.energy has no part for 'r3'; nearest: cost.energy.r"),
    ('[guarantees.g]\nkind = "formula"\non = "r1.y <"', "guarantees.g.on: column 7: expected a number"),
    ('[guarantees.g]\nkind = "formula"\non = "counter(r1.heard) < 3"', "is known when the run has ended"),
    ('[costs.c]\nkind = "quadratic"\nof = ["r1.y"]\nweights = [-1.0]', "no negative eigenvalue"),
    ('[costs.c]\nkind = "quadratic"\nof = ["r9.y"]\nweights = [1.0]', "'r9' names no node"),
    ('[costs.c]\nkind = "quadratc"', 'no such kind; did you mean "quadratic"?'),
    ('[costs.c]\nkind = "radio_energy"\non = "radio: r9"\ntransmit_w = 1', "'r9' names no node on that medium"),
    ('[costs.c]\nkind = "radio_energy"\non = "radio: r1"\ntransmit_w = -1', "expected >= 0"),
])
def test_other_mistakes_are_one_line(lines: str, words: str, refusal: Callable[[str], str]) -> None:
    assert words in refusal(lines)


def test_all_mistakes_of_a_formula_are_told(valid: str, write: Callable[[str], Path]) -> None:
    with pytest.raises(ScenarioError) as refused:
        load(write(f'{valid}\nf = "r8.y < 2 and age(radio: r1 -> r2) < 3"\n'))

    assert [problem.partition(": column ")[2][:2] for problem in refused.value.problems] == ["1:", "37"]


def test_signals_and_units_are_checked_when_nodes_have_declared_theirs(valid: str,
                                                                       write: Callable[[str], Path]) -> None:
    scenario = load(write(f'{valid}\nf = "always r1.y < 2 m"\ng = "always r1.z < 2"\n'))
    recorded = {"r1": {"y": "s"}, "r2": {"y": "m"}, "radio": {}, "quiet": {}}

    with pytest.raises(ScenarioError) as refused:
        refuse_unrecorded(scenario, recorded)

    assert [problem.split("\n")[0] for problem in refused.value.problems] == [
        "few.toml: expect.f: column 15: units do not match: r1.y is in s and 2 m is in m",
        "few.toml: expect.g: column 8: r1 has no signal 'z'; there is only y"]


@pytest.mark.parametrize("text", ["not " * 20000 + "r.x < 1", "r.x < 1" + " + 1" * 20000, "always " * 101 + "r.x < 1"])
def test_a_formula_that_is_nested_without_end_is_refused(text: str) -> None:
    with pytest.raises(FormulaError, match="nested too deeply: at most 100 operations within each other"):
        parse(text)


def test_parentheses_add_no_depth() -> None:
    assert parse("(" * 5000 + "r.x < 1" + ")" * 5000) is not None


@pytest.mark.parametrize("text", ["r.x < 1e400", "r.x < 1e-400", "always[0, 1e300 s] r.x < 1"])
def test_numbers_beyond_all_sense_are_refused(text: str) -> None:
    with pytest.raises(FormulaError, match="expected a number below 1e200"):
        parse(text)
