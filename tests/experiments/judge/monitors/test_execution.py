"""Programs that declare automata: each run judges what they record, on both hosts, and so does Python on its folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from experiments.judge.executions import check_run, graphs_of_run
from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import ScenarioError, find, load

PROGRAMS = '''
from dataclasses import dataclass

from agents.hybrid.automaton import Automaton, Edge, Mode
from agents.hybrid.modes import Modes
from agents.hybrid.region import Between

MS = 1_000_000


class Guard:
    """Watches until it hears a frame, 20 ms of which it then runs; x grows by 1 in each run."""

    @dataclass(frozen=True)
    class Settings:
        most_x: float = 3.0
        fault: str = ""             # how it breaks its automaton at 90 ms

    def __init__(self, board, settings):
        self.board, self.settings, self.x = board, settings, 0.0
        board.port("radio", self.hear, listen_only=True)
        board.record("x", "m", lambda: self.x)
        self.modes = Modes(board, self.automaton(settings, board.team), "watching", lambda: {"x": self.x})
        board.at(90 * MS, self.break_rule, sends=False)

    @staticmethod
    def automaton(settings, team):
        return Automaton({"watching": Mode(Between("x", 0, settings.most_x)), "running": Mode()},
                         [Edge("watching", "running", reset={"x": lambda at: at["x"] + 1}, apart_ns=team["apart_ns"]),
                          Edge("running", "watching")],
                         {"watching": Between("x", 0, 0)}, {"x": "m"})

    def hear(self, data):
        if self.modes.mode == "watching":
            before, self.x = {"x": self.x}, self.x + 1
            self.modes.change("running", "a frame", by=data.decode(), before=before)
            self.board.at(self.board.now_ns + 20 * MS, lambda: self.modes.change("watching", "tired"), sends=False)

    def break_rule(self):
        match self.settings.fault:
            case "edge":
                self.modes.change("watching", "bored")
            case "domain":
                self.x = 9.0
            case "by":
                self.modes.change("running", "a hunch", by="c")
            case "unreadable":
                self.board.event("mode", "tea")


class Bell:
    def __init__(self, board):
        self.board, self.radio = board, board.port("radio", listen_only=True)
        board.every(50 * MS, lambda: self.radio.send(board.name.encode()), offset_ns=55 * MS)
'''
SCENARIO = """
# Question: does what the guard records fit its automaton?
seed = 1
length_s = 0.2
[team]
apart_ns = 45_000_000
[agents.a]
program = "guards_of_the_automaton:Guard"
parameters = { fault = "FAULT" }
[agents.b]
program = "guards_of_the_automaton:Bell"
[agents.c]
program = "guards_of_the_automaton:Bell"
[media.radio]
kind = "broadcast_radio"
topology = { kind = "fixed", links = ["b -> a"] }
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "guards_of_the_automaton.py").write_text(PROGRAMS)
    return tmp_path


def loaded(folder: Path, fault: str = "", more: str = "") -> Any:
    (folder / "guards.toml").write_text(SCENARIO.replace("FAULT", fault) + more)
    return load(folder / "guards.toml")


@pytest.mark.parametrize("host", ["inline", "process"])
def test_a_run_whose_programs_declare_automata_is_judged_by_them_unasked(folder: Path, host: Any) -> None:
    scenario = loaded(folder)

    done = run(scenario, host=host, out=folder / "run", report=True)

    assert scenario.guarantees["executions"].subjects == (("a",),)
    assert [(verdict.key, verdict.value, verdict.holds) for verdict in done.summary.verdicts] == [
        ("guarantee.executions.violations", 0.0, True)]
    told = [event for event in load_run(folder / "run").events if event.kind == "mode"]
    assert [event.time_ns // 10**6 for event in told] == [0, 55, 75, 105, 125, 155, 175]
    assert told[1].detail == "watching -> running at x=0.0 then x=1.0 by b: a frame"
    assert check_run(folder / "run") == []
    _, first, *_ = graphs_of_run(folder / "run", 50_000_000)
    assert set(first.communication.edges) == {("b", "a")}
    assert set(first.communication.nodes) == {"a", "b", "c"}


@pytest.mark.parametrize(("fault", "rule"), [
    ("edge", "edge: watching -> watching"), ("domain", "domain: x=9"),
    ("by", "control: watching -> running by c: it neither heard nor saw c"),
    ("unreadable", "unreadable: the event mode tells no change of mode: 'tea'")])
def test_what_breaks_its_automaton_is_a_violation_with_its_instant(folder: Path, fault: str,
                                                                   rule: str) -> None:
    done = run(loaded(folder, fault), host="inline", out=folder / "run", report=False)

    assert not done.summary.holds
    violations = load_run(folder / "run").guarantees["executions"].violations
    assert (90, True) in [(each.from_ns // 10**6, each.cause.startswith(rule)) for each in violations]
    assert [(each.from_ns, f"{each.rule.value}: {each.what}") for each in check_run(folder / "run")] == [
        (each.from_ns, each.cause) for each in violations]


def test_a_scenario_may_expect_that_its_automaton_is_broken(folder: Path) -> None:
    stated = '[guarantees.free]\nkind = "execution"\non = "*"\nexpected = "violated"\ncontact_within_ms = 1\n'

    scenario = loaded(folder, "edge", stated)

    assert [*scenario.guarantees] == ["free"]
    assert run(scenario, host="inline", out=folder / "run", report=False).summary.holds


def test_turns_closer_than_t_min_are_violations(folder: Path) -> None:
    (folder / "guards.toml").write_text(SCENARIO.replace("45_000_000", "50_000_001"))

    run(load(folder / "guards.toml"), host="inline", out=folder / "run", report=False)

    assert [each.what for each in check_run(folder / "run")] == [
        "watching -> running: 50000000 ns after the last: expected at least 50000001 ns"] * 2


@pytest.mark.parametrize(("changed", "said"), [
    ('[guarantees.executions]\nkind = "reported"\non = "a.x"\nbelow = 1.0\n', "take another name"),
    ('[guarantees.e]\nkind = "execution"\non = "b"\n', "'b' names no agent whose program declares an automaton"),
    ('[guarantees.e]\nkind = "execution"\non = "a"\ncontact_within_ns = 0\n', "expected at least 1"),
])
def test_a_guarantee_about_executions_that_cannot_be_is_refused(folder: Path, changed: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        loaded(folder, "", changed)


@pytest.mark.parametrize(("wrong", "said"), [
    ("def automaton(settings):", r"expected automaton\(settings, team\), which returns the hybrid automaton"),
    ("def automaton(settings, team):\n        return 7", "returned int: expected an Automaton"),
    ('def automaton(settings, team):\n        team["no"]', "Guard.automaton failed: KeyError: 'no'"),
])
def test_a_declaration_that_fails_is_refused_before_the_run(folder: Path, wrong: str, said: str) -> None:
    (folder / "guards_of_the_automaton.py").write_text(PROGRAMS.replace("def automaton(settings, team):", wrong))

    with pytest.raises(ScenarioError, match=said):
        loaded(folder)


def test_without_an_automaton_there_is_nothing_to_check(folder: Path) -> None:
    text = SCENARIO.replace("automaton:Guard", "automaton:Bell").replace('parameters = { fault = "FAULT" }', "")
    (folder / "guards.toml").write_text(text)
    scenario = load(folder / "guards.toml")
    run(scenario, host="inline", out=folder / "run", report=False)

    assert scenario.guarantees == {}
    with pytest.raises(ValueError, match="no program of its scenario declares an automaton"):
        check_run(folder / "run")
    assert [set(each.communication.edges) for each in graphs_of_run(folder / "run", 10**8)] == [{("b", "a")}] * 2
    with pytest.raises(ValueError, match="expected the folder of a run"):
        check_run(folder)


def test_on_a_sensing_medium_who_is_seen_is_no_sender(tmp_path: Path) -> None:
    scenario = load(find("p3at_chases_p3at"), duration_s=1.0)
    run(scenario, host="inline", out=tmp_path / "run", report=False)

    [graphs] = graphs_of_run(tmp_path / "run", 10**9, control=[("evader", "pursuer"), ("drive", "evader")])

    assert set(graphs.sensing.edges) == {("evader", "pursuer")}
    assert ("evader", "pursuer") not in graphs.communication.edges
    assert ("pursuer", "drive") in graphs.communication.edges           # setpoints, on CAN
    assert graphs.unsupported() == [("drive", "evader")]
