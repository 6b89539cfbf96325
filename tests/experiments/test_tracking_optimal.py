"""The policy `optimal` end to end: a table made before the run, over radio and CAN, and what it says about itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

import numpy as np
import pytest

from agents.tracking.controller import Inputs
from agents.tracking.error_system import LIMITS, TrackingErrorSystem
from agents.tracking.optimal_preparation import interval_tables
from agents.tracking.section_4_6 import GAINS
from agents.triggering.policies.table import PolicySettings, build_policy
from experiments.judge.costs.accrued import accrued
from experiments.judge.link_metrics import transmissions
from experiments.judge.run_data import RunData, load_run
from experiments.judge.run_result import Progress
from experiments.run.node_specifications import node_specifications
from experiments.run.runner import run
from experiments.scenario import ScenarioError, load
from experiments.scenario.library import find

COARSE = ["team.optimal.x_m=[0.2, 0.8, 3.0, 10.0]", "team.optimal.heading_rad=[0.4, 3.14]", "team.optimal.candidates=8",
          "expect={}"]


def emulated(out: Path, *overrides: str, duration_s: float = 2.0, source: Path | None = None) -> RunData:
    scenario = load(source or find("tracking_optimal"), duration_s=duration_s, overrides=[*COARSE, *overrides])
    return load_run(run(scenario, host="inline", out=out, report=False).folder)


def warnings(data: RunData) -> list[str]:
    return [f"{event.kind}: {event.detail}" for event in data.events if event.kind in (
        "optimal policy", "assumption violated")]


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> RunData:
    return emulated(tmp_path_factory.mktemp("optimal"))


def test_the_cost_of_a_look_is_the_energy_that_the_ledger_shows(data: RunData) -> None:
    scenario = load(find("tracking_optimal"), overrides=COARSE)
    (team,) = {id(each.team): each.team for each in node_specifications(scenario).values()}.values()
    answered = data.ledger.only(fate="delivered")
    airtime_s = (answered.ints("end_ns") - answered.ints("on_air_ns"))[answered.ints("on_air_ns") >= 0]

    of_radio = np.array([medium == "radio" for medium, _, _ in answered.link.names])[answered.link.codes]
    energy_j = 0.56 * airtime_s[of_radio].sum() * 1e-9
    requests = data.counters["companion"]["looks"]
    announcements = energy_j - requests * team["optimal_look_cost_j"]

    assert team["optimal_look_cost_j"] == pytest.approx(1.5288e-4)
    assert announcements == pytest.approx(0.56 * 228e-6, rel=1)         # one announcement, at 1.83 s, or none
    assert accrued("energy", "", data).last[-1] == pytest.approx(energy_j)


def test_the_total_cost_is_the_integral_and_s_for_each_frame(data: RunData) -> None:
    sent = transmissions(data.ledger)
    requests = int((sent.source.codes == sent.source.names.index(("radio", "companion"))).sum())
    error, drive = data.signals["error"], data.signals["drive"]
    held = 0.1 * sum(error.column(name) ** 2 for name in ("x1", "x2", "x3")) + 0.1 * (
        drive.column("v") ** 2 + drive.column("omega") ** 2)
    kept_s = np.diff(np.r_[error.time_ns, data.length_ns]) * 1e-9

    assert accrued("total", "", data).last[-1] == pytest.approx(
        (held * kept_s).sum() + requests * 1.5288e-4, rel=1e-6)


def test_the_folder_has_figure_5_3_with_the_cost_of_a_look_and_no_robot_has_its_numbers(data: RunData) -> None:
    team = next(iter(node_specifications(load(find("tracking_optimal"), overrides=COARSE)).values())).team

    assert [chart.title.partition(",")[0] for chart in data.charts] == [
        "Figure 5.3 (F3): h at x3 = 0", "tau* near 0"] * 3
    assert data.charts[0].note.startswith("S = 0.000153 J; cost ")
    assert {key for each in team["optimal_tables"] for key in each} == {
        "inputs", "axes", "tau_s", "cap_s", "shortest_s", "rate"}


def test_the_runner_hears_how_far_the_tables_are(tmp_path: Path) -> None:
    heard: list[Progress] = []
    scenario = load(find("tracking_optimal"), duration_s=0.02, overrides=[*COARSE, "team.optimal.look_cost_j=2e-4"])

    run(scenario, host="inline", out=tmp_path / "run", report=False, progress=heard.append)

    told = [each for each in heard if each.preparing]
    assert heard[:len(told)] == told
    assert [each.preparing for each in told] == [f"tables of the optimal policy: {done} of 9" for done in range(10)]
    assert [each.prepared for each in told] == [done / 9 for done in range(10)]


def test_a_decision_takes_no_longer_than_one_of_the_certified_policy() -> None:
    scenario = load(find("tracking_optimal"), overrides=COARSE)
    team = next(iter(node_specifications(scenario).values())).team
    optimal = build_policy("optimal", TrackingErrorSystem(limits=LIMITS), GAINS,
                           PolicySettings(tables=interval_tables(team)))
    certified = build_policy("individual_gains", TrackingErrorSystem(limits=LIMITS), GAINS)
    states = np.random.default_rng(0).uniform(-3, 3, (300, 3)).tolist()

    def fastest_s(policy: object) -> float:
        found = []
        for _ in range(5):
            began_s = perf_counter()
            for x in states:
                policy.decide(0, tuple(x), Inputs(1.0, 1.0))          # type: ignore[attr-defined]
            found.append(perf_counter() - began_s)
        return min(found)

    assert fastest_s(optimal) <= fastest_s(certified)


def test_a_state_outside_the_table_is_clamped_counted_and_told(tmp_path: Path) -> None:
    data = emulated(tmp_path, "agents.reference.plant.parameters.x=14.0", duration_s=0.5)

    counters = data.counters["companion"]
    assert 0 < counters["states outside the table"] < counters["measurements"]
    (said,) = warnings(data)                                    # once, until a state is within again
    assert said.startswith("assumption violated: table of intervals: x = (")


@pytest.mark.parametrize(("override", "said"), [
    ('team.optimal.formulation="per_transmission"', 'makes every interval the shortest, 0.005 s: '
     'formulation="per_transmission" discounts by looks, so S does not change which interval is best (F1)'),
    ("team.optimal.look_cost_j=1e6", 'S = 1e+06 J makes every interval its cap (cap="local")')])
def test_a_cost_that_makes_all_intervals_equal_is_told(override: str, said: str, tmp_path: Path) -> None:
    data = emulated(tmp_path, override, duration_s=0.1)

    (warning,) = [each for each in warnings(data) if each.startswith("optimal policy")]
    assert said in warning


@pytest.mark.parametrize(("overrides", "said"), [
    (["team.optimal.shortest_ms=20", 'team.optimal.cap="printed"'],
     'team.optimal.shortest_ms=20: the cap "printed" is '),
    (["team.optimal.transmit_w=0", "team.optimal.receive_w=0"], "team.optimal.transmit_w=0: expected the power"),
    (["team.optimal.transmit_w=-1"], "team.optimal.transmit_w=-1: expected 0 or more"),
    (['team.optimal.cap="best"'], 'team.optimal.cap="best"'),
    (["team.optimal.candidates=1"], "team.optimal.candidates=1: expected 2 to 64")])
def test_settings_that_make_no_table_are_refused(overrides: Sequence[str], said: str) -> None:
    with pytest.raises(ScenarioError) as refused:
        load(find("tracking_optimal"), overrides=[*COARSE, *overrides])

    assert said in str(refused.value)


def test_a_policy_that_allows_for_losses_stays_within_its_cap(tmp_path: Path) -> None:
    text = find("tracking_optimal").read_text() + """
[[impairments]]
on = "radio: reference -> companion"
kind = "scripted_loss"
lose_frames = [2]
every = 3
"""
    (tmp_path / "lossy.toml").write_text(text)

    data = emulated(tmp_path / "run", "agents.companion.parameters.max_successive_losses=1",
                    "guarantees={}", source=tmp_path / "lossy.toml", duration_s=1.5)

    counters = data.counters["companion"]
    assert counters["looks without an answer"] >= counters["looks"] // 4
    assert counters["violated assumptions"] == 0
    tau_s, interval_s = (data.signals["companion"].column(name)[10:] for name in ("tau", "interval"))
    assert (2 * interval_s <= tau_s).all()


@pytest.mark.parametrize("observer", ["particle", pytest.param("unscented", marks=pytest.mark.slow)])
def test_a_robot_drives_by_what_its_observer_estimates(observer: str, tmp_path: Path) -> None:
    data = emulated(tmp_path, f'team.optimal.observer="{observer}"', duration_s=3.0)

    counters, norm = data.counters["companion"], data.signals["error"].column("norm")
    assert norm[-50:].max() < 1.0 < norm[0]
    told = [event for event in data.events if event.kind == "particles drawn anew"]
    assert bool(told) == bool(counters["particles drawn anew"])
    assert counters["particles drawn anew"] < counters["measurements"] / 2
    held = np.array([data.signals["companion"].column(f"held{k}") for k in (1, 2, 3)])
    true = np.array([data.signals["error"].column(f"x{k}") for k in (1, 2, 3)])
    fresh = np.flatnonzero((np.diff(held, axis=1) != 0).any(axis=0)) + 1       # within 10 ms after a look
    late = fresh[fresh > 200]
    assert np.sqrt(((held - true)[:, late] ** 2).sum(axis=0).mean()) < 0.3


def test_a_delay_of_looks_that_the_tables_do_not_know_is_refused():
    delay = 'impairments=[{ on = "radio: reference -> companion", kind = "delay", delay_ms = 3 }]'
    with pytest.raises(ScenarioError, match=r"agents\.companion\.parameters\.policy='optimal': its tables take no"):
        load(find("tracking_optimal"), overrides=[delay])
