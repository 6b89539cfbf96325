"""`import marconet`: load or build a scenario, run it, look at its records; the same errors as on the command line."""

from __future__ import annotations

import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import marconet
from experiments.scenario.toml_text import toml_text

ROOT = Path(__file__).parents[2]
SCENARIO = """\
# Question: is the other one heard?
seed = 3
length_s = 0.1
[agents.r1]
program = "beacon_of_the_face:Beacon"
[agents.r2]
program = "beacon_of_the_face:Beacon"
parameters = { offset_ns = 5_000_000 }
[media.radio]
kind = "broadcast_radio"
[expect]
"count.r2.heard" = { min = 5 }
"""
PROGRAM = """\
from dataclasses import dataclass


class Beacon:
    @dataclass
    class Settings:
        period_ns: int = 10_000_000
        offset_ns: int = 1_000_000

    def __init__(self, board, settings):
        self.board, self.sent = board, 0
        self.port = board.port("radio", lambda data: board.count("heard"))
        board.record("sent", "1", lambda: self.sent)
        board.every(settings.period_ns, self.say, offset_ns=settings.offset_ns)

    def say(self):
        self.port.send(b"here")
        self.board.event("said")
        self.sent += 1
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "beacon_of_the_face.py").write_text(PROGRAM)
    (tmp_path / "beacons.toml").write_text(SCENARIO)
    return tmp_path


def test_a_scenario_built_in_python_runs_as_the_one_from_the_file(here: Path) -> None:
    loaded = marconet.load("beacons.toml")
    built = marconet.Scenario("beacons", **tomllib.loads(SCENARIO))

    runs = [marconet.run(scenario, host=host, out=here / f"{name}-{host}") for name, scenario in
            (("loaded", loaded), ("built", built)) for host in ("inline", "process")]

    assert {run.ledger_hash for run in runs} == {runs[0].ledger_hash}
    assert all(run.holds for run in runs)
    assert loaded.question == "is the other one heard?"


def test_both_give_the_same_errors(here: Path) -> None:
    tables = tomllib.loads(SCENARIO)
    tables["seed"] = -1
    tables["media"]["radio"]["kindd"] = (1, 2)
    (here / "wrong.toml").write_text(SCENARIO.replace("seed = 3", "seed = -1") + "[media.radio.kindd]\n")

    with pytest.raises(marconet.ScenarioError) as by_python:
        marconet.Scenario("wrong", **tables)
    with pytest.raises(marconet.ScenarioError) as by_file:
        marconet.load("wrong.toml", set={"media.radio.kindd": (1, 2)})

    assert str(by_python.value) == str(by_file.value)
    assert "wrong.toml: seed=-1: expected >= 0" in str(by_python.value)


def test_what_was_set_is_run_and_repeated_by_the_command_that_the_run_tells(here: Path) -> None:
    scenario = marconet.load("beacons.toml", set={"agents.r1.parameters": {"offset_ns": 2_000_000}}, seed=9,
                             length_s=0.2)
    run = marconet.run(scenario, host="inline", out="first")

    done = subprocess.run([sys.executable, "-m", "marconet.command_line", *shlex.split(run.repeat())[1:], "--out",
                           "second", "--no-report"], capture_output=True, text=True, check=False,
                          env={"PYTHONPATH": str(ROOT), "PATH": ""})

    assert done.returncode == 0, done.stderr
    assert run.ledger_hash in (here / "second" / "summary.json").read_text()
    assert (scenario.seed, scenario.length_s) == (9, 0.2)


@pytest.mark.parametrize(("path", "told"), [
    ("media.radoi.kind", "did you mean"), ("", "expected path.to.key"), ("seed=4", "expected path.to.key"),
    ("impairments[0].loss_ratio", "has 0 entries"), ("agents.r1.clock.offst_ns", "did you mean")])
def test_a_wrong_path_is_told(here: Path, path: str, told: str) -> None:
    with pytest.raises(marconet.ScenarioError, match=told):
        marconet.load("beacons.toml", set={path: 1})


def test_records_are_data_frames(here: Path) -> None:
    pytest.importorskip("polars", reason="needs polars: pip install -e '.[frames]'")

    run = marconet.run("beacons.toml", host="inline", out="frames")

    assert run.expectations.rows() == [("count.r2.heard", 10.0, 5.0, None, True, "", "", "", None, "", "",
                                        None, False)]
    assert run.ledger.filter(sender="r1")["fate"].to_list() == ["delivered"] * 10
    assert run.signals["r2"].columns == ["time_ns", "sent"]
    assert run.signals["r2"]["time_ns"].to_list() == [10_000_000 * k for k in range(10)]
    assert run.units["r2"] == {"sent": "1"}
    assert run.events.filter(node="r1")["time_ns"].to_list() == [10_000_000 * k + 1_000_000 for k in range(10)]
    assert run.counters["r2"]["heard"] == 10


def test_a_broken_expectation_is_told_with_its_instant_and_shown_in_a_notebook(here: Path) -> None:
    run = marconet.run(marconet.load("beacons.toml", set={"expect": {"r1.sent.max": {"max": 3}}}), host="inline",
                       out="broken")

    assert not run.holds
    assert run.first_violation() == ("r1.sent.max is 9: 6 above the most allowed, 3 "
                                     "(t = 0.09 s: r1.sent: the largest value)")
    assert "6 above the most allowed, 3" in run._repr_html_()
    assert "<svg" in run._repr_html_()
    assert run.report().read_text().startswith("<!doctype html>")
    assert str(run.folder) in repr(run)


def test_only_what_is_promised_is_there() -> None:
    assert all(getattr(marconet, name) for name in marconet.__all__)
    with pytest.raises(AttributeError, match="has no attribute 'laod'; it has NodeFailure, Run, Scenario"):
        _ = marconet.laod


def test_importing_it_loads_nothing_of_the_emulator() -> None:
    code = ("import sys, marconet; "
            "print([name for name in sys.modules if name.split('.')[0] in ('netem', 'experiments')])")

    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)

    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("value", [True, 0.25, -3, "it's \\ \"so\"", "\U0001f916 robot", [1, [2]], {"a": {"b c": "x"}}])
def test_a_changed_value_is_told_in_toml(value: object) -> None:
    assert tomllib.loads(f"value = {toml_text(value)}") == {"value": value}
