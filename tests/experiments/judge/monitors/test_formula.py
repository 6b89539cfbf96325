"""A formula as a guarantee: its violations are the stretches of time in which its robustness is negative."""

from __future__ import annotations

import numpy as np

from experiments.judge.monitors.formula import Formula
from experiments.judge.monitors.records import Records
from experiments.scenario.subjects import formula_subjects
from netem.core.fate import Fate
from tests.experiments.judge.formula.runs import MS, S, frames, signals

LINKS = {"radio: r1 -> r2": [("radio", "r1", "r2")]}


def records() -> Records:
    sent = [(at, Fate.LOST, -1) if at in (300, 400) else (at, Fate.DELIVERED, at + 2) for at in range(0, 1000, 100)]
    return Records(S, frames(*sent), signals("r1", every_ns=100 * MS, x=[0, 3, 3, 0, 0, 0, 5, 0, 0, 0]))


def test_a_violation_lasts_from_the_crossing_to_the_arrival() -> None:
    formula = "age(radio: r1 -> r2) < 250 ms"

    found = Formula().watch(formula_subjects(formula, LINKS), records())

    (violation,) = found.violations
    assert (violation.from_ns, violation.until_ns) == (450 * MS, 502 * MS)
    assert np.isclose(violation.worst or 0.0, -0.052)
    assert violation.cause == "decides at 0.502 s"


def test_each_stretch_is_a_violation_and_the_worst_is_that_of_the_run() -> None:
    found = Formula().watch(formula_subjects("r1.x <= 2", {}), records())

    assert [(each.from_ns, each.until_ns, each.worst) for each in found.violations] == [
        (100 * MS, 300 * MS, -1.0), (600 * MS, 700 * MS, -3.0)]
    assert found.worst == found.margin == -3.0


def test_the_instants_at_which_the_records_do_not_reach_far_enough_are_left_out() -> None:
    found = Formula().watch(formula_subjects("eventually[0, 400 ms] r1.x > 2", {}), records())

    assert found.violations == []                       # at 0.6 s the window ends with the run


def test_what_cannot_be_judged_says_why() -> None:
    found = Formula().watch(formula_subjects("eventually[0, 2 s] r1.x > 2", {}), records())

    assert not found.judged
    assert found.why == "it looks 2 s ahead, and the run ended at 1 s"
