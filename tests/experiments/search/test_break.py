"""`marconet break` on real runs: what it finds diverges by an independent oracle, what cannot be is not found."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.linalg import expm

from agents.synchronization.round_plans import RoundPlans
from agents.synchronization.team import read_team
from experiments.run.runner import run
from experiments.scenario import load
from experiments.scenario.model import Scenario
from experiments.search.base import Base
from experiments.search.budget import BadBudget, LossLimit, breach
from experiments.search.falsify import Found, Wanted, falsify
from experiments.search.objective import Objective
from experiments.search.strategy import RandomSearch
from experiments.sweep.vary import parse
from marconet.command_line import app
from tests.processes import alive, children

ROOT = Path(__file__).parents[3]

PAIR = ROOT / "benchmarks" / "search_pair.toml"
ONE_IN_A_ROW = "radio: * -> *: at most 1 lost in a row"
CERTIFIED_US = 13_285


def search(base: Base, objective: str, runs: int, out: Path, *budgets: str, largest: bool = False, **options: object
           ) -> Found:
    return falsify(Wanted(base, budgets, Objective.of(objective, base, largest=largest), runs, out=out,
                          **{"jobs": 2} | options))        # type: ignore[arg-type]


def file_of(found: Found) -> Path:
    assert found.file is not None
    return found.file


def lost_on(scenario: Scenario, frames: int) -> dict[str, list[int]]:
    """The frames that a scenario loses on the links of its radio, by sender."""
    found: dict[str, list[int]] = {}
    for spec in scenario.impairments:
        assert spec.kind == "scripted_loss"
        every = spec.fields.get("every") or frames
        for _, sender, _ in spec.links:
            found[sender] = [n for n in range(frames) if n % every in spec.fields["lose_frames"]]
    return found


def growth(slot_s: float, lost: dict[str, list[int]], rounds: int) -> float:
    """The spectral radius of the exact map of two robots over so many rounds, each with its copies of the outputs.

    z = (x2, x3, what r2 sent last, what r3 sent last, what r3 holds of r2, what r2 holds of r3). Airtime is neglected.
    """
    flow = np.zeros((7, 7))
    flow[0, 0], flow[1:3, 1:3] = 1.0, [[-2.0, -5.0], [1.0, -1.0]]
    flow[0, [3, 6]] = 5.0, -5.0                         # B K = -5: u = -K (own - held)
    flow[1:3, 4], flow[1:3, 5] = [4.0, 2.0], [-4.0, -2.0]       # B K = (-4, -2)
    slot = expm(flow * slot_s)
    outputs = {"r2": np.array([-4.0, 0, 0, 0, 0, 0, 0]), "r3": np.array([0, 1.0, 1.0, 0, 0, 0, 0])}
    whole = np.eye(7)
    for number in range(rounds):
        for sender, own, held in (("r2", 3, 5), ("r3", 4, 6)):
            jump = np.eye(7)
            jump[own] = outputs[sender]
            if number not in lost.get(sender, []):
                jump[held] = outputs[sender]
            whole = slot @ jump @ whole
    return float(max(abs(np.linalg.eigvals(whole))))


@pytest.mark.slow
def test_above_the_exact_limit_a_pattern_is_found_within_200_runs_that_diverges(tmp_path: Path) -> None:
    base = Base.of(PAIR, values={"length_s": 7.2})      # 80 rounds of 90 ms, so that what diverges outgrows transients

    found = search(base, "always[7 s, 7.2 s] max(abs(r2.y), abs(r3.y)) < 0.5", 60, tmp_path, ONE_IN_A_ROW)

    scenario = load(file_of(found))
    rounds = 80
    lost = lost_on(scenario, rounds)
    assert found.without > 0 > found.value
    assert all(breach(numbers, [LossLimit(1, 2)]) == "" for numbers in lost.values())
    assert growth(0.045, {}, 1) < 1                     # without losses it converges
    assert growth(0.045, {name: [0] for name in lost}, 2) > 1          # exact limit 41.4 ms: every other frame
    assert growth(0.041, {name: [0] for name in lost}, 2) < 1
    assert growth(0.045, lost, rounds) > 1              # what was found, over and over, diverges
    again = run(scenario, host="inline", out=tmp_path / "again", report=False).summary
    assert [verdict.value for verdict in again.verdicts if verdict.key == "searched"] == [found.value]
    assert found.warnings == []


@pytest.mark.slow
def test_below_the_certified_slot_length_no_pattern_is_found(tmp_path: Path) -> None:
    base = Base.of(PAIR, overrides=(f"team.slot_us={CERTIFIED_US}",))
    team = read_team(base.scenario.team)
    plan = RoundPlans(team).plan(team.laplacian_of(["r2 <-> r3"]))
    assert plan is not None
    assert CERTIFIED_US * 1000 <= plan.certified_ns < (CERTIFIED_US + 1) * 1000

    found = search(base, "agree", 40, tmp_path, ONE_IN_A_ROW)

    assert found.value > 0
    assert len(found.costs) == 40


@pytest.mark.slow
def test_below_the_certified_slot_length_no_pattern_is_found_in_10_000_runs(tmp_path: Path) -> None:
    base = Base.of(PAIR, overrides=(f"team.slot_us={CERTIFIED_US}",))

    found = search(base, "agree", 10_000, tmp_path, ONE_IN_A_ROW, jobs=None)

    assert found.value > 0
    assert len(found.costs) == 10_000


@pytest.mark.slow
def test_the_outcome_does_not_depend_on_the_number_of_runs_at_a_time(watched: Path, tmp_path: Path) -> None:
    base = Base.of(watched)
    found = [search(base, "count.c.heard", 30, watched.parent, "radio: * -> c: at most 2 lost of 7",
                    "faults: at most 2", jobs=jobs) for jobs in (1, 2)]
    other = search(base, "count.c.heard", 30, watched.parent, "radio: * -> c: at most 2 lost of 7",
                   "faults: at most 2", seed=1)

    assert found[0].costs == found[1].costs != other.costs
    assert found[0].candidate == found[1].candidate
    assert found[0].file != found[1].file                      # none is overwritten
    assert file_of(found[0]).read_text() == file_of(found[1]).read_text()


@pytest.mark.slow
def test_faults_are_found_that_cost_most_and_no_more_than_allowed(watched: Path, tmp_path: Path) -> None:
    base = Base.of(watched)

    found = search(base, "c.missed.last", 100, watched.parent, "faults: at most 2 of pause, kill", largest=True)

    scenario = load(file_of(found))
    # Two faults of up to a quarter of the run, some 11 rounds each, for each of the two beacons at best.
    assert 1 <= len(scenario.faults) <= 2
    assert {fault.kind for fault in scenario.faults} <= {"pause", "kill"}
    assert (found.without, found.value >= 12) == (0, True)
    again = run(scenario, host="inline", out=tmp_path / "again", report=False).summary
    of = {verdict.key: verdict for verdict in again.verdicts}
    assert (of["c.missed.last"].value, of["c.missed.last"].holds) == (found.value, False)


@pytest.mark.slow
def test_the_search_does_better_than_random_search_with_as_many_runs(tmp_path: Path) -> None:
    """At 25 ms of the slot only few patterns violate the formula, by the transient alone."""
    base = Base.of(PAIR, overrides=("team.slot_us=25000",))

    ours = search(base, "agree", 60, tmp_path, ONE_IN_A_ROW)
    by_chance = search(base, "agree", 60, tmp_path, ONE_IN_A_ROW,
                       strategy=lambda space, runs, seed: RandomSearch(space, seed))

    assert ours.value < by_chance.value


@pytest.mark.slow
def test_a_continuous_setting_is_searched_by_cma(watched: Path, tmp_path: Path) -> None:
    pytest.importorskip("cma")
    base = Base.of(watched)

    found = search(base, "c.bowl.last", 100, watched.parent, varied=[parse("agents.c.parameters.bias=0:1")])

    # The bowl's least value is 0 at 0.3; of 100 points on a grid the best would be some 1e-5.
    assert found.value < 1e-6
    assert abs(load(file_of(found)).agents["c"].parameters["bias"] - 0.3) < 1e-3


@pytest.mark.slow
def test_losses_of_the_scenario_itself_are_left_out_on_the_links_of_the_budget(watched: Path, tmp_path: Path) -> None:
    watched.write_text(watched.read_text() + '[[impairments]]\non = "radio: * -> c"\nkind = "bernoulli_loss"\n'
                       'loss_ratio = 0.5\n')
    base = Base.of(watched)

    found = search(base, "count.c.heard", 10, watched.parent, "radio: a -> c: at most 1 lost in a row")

    kinds = [(spec.kind, spec.links) for spec in load(file_of(found)).impairments]
    assert ("bernoulli_loss", (("radio", "b", "c"),)) in kinds
    assert ("scripted_loss", (("radio", "a", "c"),)) in kinds
    assert len(kinds) == 2
    # 45 frames of a, of which every other one may be lost, and the same draw of b's in both runs.
    assert found.without - found.value == 23


def test_when_nothing_is_worse_than_no_loss_that_is_told_and_no_scenario_is_written(watched: Path) -> None:
    told = subprocess.run(
        [sys.executable, "-m", "marconet.command_line", "break", str(watched), "--budget",
         "radio: a -> b: at most 1 lost in a row", "--minimize", "count.c.heard", "--runs", "5", "--jobs", "1"],
        capture_output=True, text=True, check=False)

    assert (told.returncode, told.stderr) == (0, "")
    assert told.stdout.splitlines()[-1] == ("count.c.heard: 90 without losses and faults, and nothing worse in 5 runs "
                                            "within the budget")
    assert [file.name for file in watched.parent.glob("*.toml")] == ["watched.toml"]


@pytest.mark.slow
def test_ctrl_c_leaves_the_worst_so_far_and_no_worker(watched: Path) -> None:
    with subprocess.Popen(
            [sys.executable, "-m", "marconet.command_line", "break", str(watched), "--budget",
             "radio: a -> c: at most 1 lost in a row", "--minimize", "count.c.heard", "--runs", "9999", "--jobs", "1"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True) as running:
        assert running.stdout is not None
        while "runs" not in running.stdout.readline():        # the first line comes after at least 20 runs or 5 s
            pass
        for _ in range(2):                                      # two generations at least have ended then
            running.stdout.readline()
        workers = children(running.pid)
        running.send_signal(signal.SIGINT)
        _, errors = running.communicate(timeout=60)

    assert running.returncode == 130
    first, second = errors.splitlines()
    assert (first, second) == (f"the worst so far: {watched.parent / 'watched_worst.toml'}", "interrupted (SIGINT)")
    assert load(watched.parent / "watched_worst.toml").impairments
    assert workers
    assert not any(map(alive, workers))


@pytest.mark.slow
def test_a_jammer_is_found_that_costs_most(watched: Path) -> None:
    """The kind is drawn with who hears it: only jammers that the watch hears keep beacons from it."""
    found = search(Base.of(watched), "count.c.heard", 40, watched.parent, "faults: at most 1 of jam")

    (fault,) = load(file_of(found)).faults
    assert (fault.kind, fault.targets) == ("jam", (("radio",),))
    assert fault.settings.nodes in (("c",), ("*",))
    # A jammer lasts up to a quarter of the run of 45 rounds; each round has two beacons.
    assert 90 - 2 * 12 <= found.value <= 90 - 2 * 8
    assert found.lines[0].startswith("jam of radio (nodes = [")


@pytest.mark.parametrize(("budgets", "objective", "problem"), [
    (["radio: c -> a: at most 1 lost in a row"], "count.c.split", "no frame is received on radio: c -> a, so nothing"),
    ([], "count.c.split", "what may the search change? Give --budget"),
    ([ONE_IN_A_ROW], "count.c.spilt", "has no such figure, so there is nothing to search"),
    (["faults: at most 3 of kill, babble"], "count.c.split",
     "--budget faults of babble: nothing in the scenario takes one: it needs a CAN bus with two nodes or more; leave "),
])
def test_a_search_that_can_find_nothing_is_refused(watched: Path, budgets: list[str], objective: str, problem: str
                                                   ) -> None:
    base = Base.of(watched)

    with pytest.raises(BadBudget) as refused:
        search(base, objective, 10, watched.parent, *budgets)

    assert problem in str(refused.value)
    assert sorted(file.name for file in watched.parent.glob("*.toml")) == ["watched.toml"]


def test_the_command_tells_cost_and_command_and_its_scenario_repeats_it(watched: Path) -> None:
    formula = "always[0.5 s, 4 s] c.missed < 1"
    told = subprocess.run(
        [sys.executable, "-m", "marconet.command_line", "break", str(watched), "--budget",
         "radio: a -> c: at most 1 lost of 20", "--minimize", formula, "--runs", "12", "--jobs", "1", "--json",
         "--out", str(watched.parent)], capture_output=True, text=True, check=False)
    document = json.loads(told.stdout)

    repeated = subprocess.run([*document["command"].replace("marconet", f"{sys.executable} -m marconet.command_line", 1)
                               .split(), "--json", "--out", str(watched.parent / "run")], capture_output=True,
                              text=True, check=False)

    assert (told.returncode, told.stderr, repeated.returncode) == (1, "", 1)
    verdict = next(line for line in json.loads(repeated.stdout)["runs"][0]["summary"]["verdicts"]
                   if line["formula"] == formula)
    assert (document["figure"], document["value"], document["without"]) == (formula, verdict["value"], 1.0)
    # 45 frames, at most one of twenty: three losses by the end of the formula's window.
    assert document["value"] in (-1.0, -2.0)


@pytest.mark.parametrize(("options", "line"), [
    (["--budget", "faults: at most 0", "--minimize", "delivery_ratio"],
     "--budget 'faults: at most 0': allows no fault, so nothing can use it: expected at least 1"),
    (["--budget", ONE_IN_A_ROW],
     "what is the search to make worse? Give --minimize or --maximize with a formula, as in --minimize 'always r1.gap "
     "> 0.5 m', or a figure's key"),
    (["--budget", ONE_IN_A_ROW, "--minimize", "delivery_ratio", "--runs", "0"], "--runs 0: expected at least 1"),
])
def test_bad_options_are_told_in_one_line(watched: Path, options: list[str], line: str) -> None:
    told = CliRunner().invoke(app, ["break", str(watched), *options])

    assert (told.exit_code, told.stderr) == (2, f"{line}\n")
