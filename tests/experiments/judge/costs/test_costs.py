"""Costs on runs small enough to work out by hand, and against brute force."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.judge.costs import NotAccrued
from experiments.judge.costs.quadratic import Quadratic
from experiments.judge.costs.radio_energy import RadioEnergy
from experiments.judge.formula import curve as curves
from experiments.judge.formula.robustness import robustness
from experiments.judge.frame_copies import FrameCopies
from experiments.judge.metrics import measure
from netem.core.fate import Fate
from tests.experiments.judge.formula.runs import MS, S, frames, rows, run, signals

ENERGY = {"kind": "radio_energy", "fields": {"on": "radio: *", "transmit_w": 2.0, "receive_w": 1.0, "idle_w": 0.5},
          "unit": "J", "nodes": ["r1", "r2"], "signals": []}


def test_a_quadratic_cost_is_the_integral_over_held_samples() -> None:
    data = run(4 * S, signals=signals("r1", x=[1, -2, 3, 0], u=[0, 1, 1, 0]))

    found = Quadratic(("r1.x", "r1.u"), [1.0, 10.0]).accrue(data)[""]

    assert found.last[-1] == (1 + 0) + (4 + 10) + (9 + 10) + 0
    assert curves.value(found, 1.5 * S) == 1 + 14 / 2


def test_a_matrix_of_weights_has_cross_terms() -> None:
    data = run(1 * S, signals=signals("r1", x=[2], u=[3]))

    found = Quadratic(("r1.x", "r1.u"), [[2.0, -1.0], [-1.0, 2.0]]).accrue(data)[""]

    assert found.last[-1] == 2 * 4 + 2 * 9 - 2 * 6


@pytest.mark.parametrize(("weights", "rule"), [
    ([1.0], "expected 2 numbers"), ([[1.0, 2.0], [0.0, 1.0]], "symmetric"), ([1.0, -1.0], "no negative eigenvalue"),
    ([[1.0, 2.0], [2.0, 1.0]], "no negative eigenvalue"), ([[1.0], [2.0]], "expected 2 numbers")])
def test_weights_that_are_no_cost_are_refused(weights: Any, rule: str) -> None:
    with pytest.raises(ValueError, match=rule):
        Quadratic(("r1.x", "r1.u"), weights)


def test_without_its_signal_a_cost_has_no_value() -> None:
    with pytest.raises(NotAccrued, match=r"no signal r1\.x"):
        Quadratic(("r1.x",), [1.0]).accrue(run(1 * S))


def test_the_energy_of_a_radio_is_power_times_time_in_each_state() -> None:
    data = run(100 * MS, frames((10, Fate.DELIVERED, 12), (20, Fate.LOST, -1), (40, Fate.TOO_WEAK, -1)))
    cost = RadioEnergy("radio: *", transmit_w=2.0, receive_w=1.0, idle_w=0.5)

    found = cost.accrue(data)

    assert found["r1"].last[-1] == pytest.approx(3e-3 * 2.0 + 97e-3 * 0.5)      # 1 ms for each of three frames
    assert found["r2"].last[-1] == pytest.approx(2e-3 * 1.0 + 98e-3 * 0.5)      # the last one is below its sensitivity
    assert curves.value(found["r1"], 10.5 * MS) == pytest.approx(10e-3 * 0.5 + 0.5e-3 * 2.0)


@given(st.lists(st.tuples(st.integers(0, 90), st.booleans()), max_size=12))
def test_energy_is_that_of_brute_force_millisecond_by_millisecond(sent: list[tuple[int, bool]]) -> None:
    """Two nodes send 1 ms frames at whole ms; both may send at once, and then neither receives."""
    cost = RadioEnergy("radio: r1", transmit_w=4.0, receive_w=2.0, idle_w=1.0)
    sends, hears = ({at for at, first in sent if first == mine} for mine in (True, False))
    expected = sum(4.0 if ms in sends else 2.0 if ms in hears else 1.0 for ms in range(100)) * 1e-3

    joined = FrameCopies.of_rows([*rows(*[(at, Fate.DELIVERED, at + 2) for at in sorted(sends)]),
                                  *rows(*[(at, Fate.DELIVERED, at + 2) for at in sorted(hears)], sender="r2",
                                        receiver="r1")])

    found = cost.accrue(run(100 * MS, joined, scenario={"media": {"radio": {"nodes": ["r1", "r2"]}}}))

    assert found["r1"].last[-1] == pytest.approx(expected)


def test_a_cost_is_a_figure_and_a_term_of_formulas() -> None:
    data = run(100 * MS, frames((10, Fate.DELIVERED, 12)), scenario={"costs": {"energy": ENERGY}, "agents": {}})

    assert measure("cost.energy.r1", data) == pytest.approx(2e-3 + 99e-3 * 0.5)
    assert measure("cost.energy", data) == pytest.approx(2e-3 + 1e-3 + 198e-3 * 0.5)
    found = robustness(data, "always[0, 50 ms] cost(energy.r1) < 30 mJ")
    assert (found.value, found.unit, found.time_s) == (pytest.approx(0.03 - 2e-3 - 49e-3 * 0.5), "J", 0.05)
    assert np.isfinite(robustness(data, "always cost(energy) < 1 J").value)
