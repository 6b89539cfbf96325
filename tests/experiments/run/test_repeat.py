"""The folder of a run tells what it was made with, so that the run can be made again from its folder alone."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

import marconet
from experiments.run.repeat import made_with
from experiments.scenario import ScenarioError
from marconet.command_line import app

PROGRAM = '''
from dataclasses import dataclass


class Beacon:
    @dataclass
    class Settings:
        period_ns: int = 10_000_000
        offset_ns: int = 0

    def __init__(self, board, settings):
        self.radio = board.port("radio", lambda frame: board.count("heard"), listen_only=True)
        board.count("heard", 0)
        board.every(settings.period_ns, lambda: self.radio.send(bytes(8)), offset_ns=settings.offset_ns)
'''
SCENARIO = '''
seed = 3
length_s = 0.5
[agents_defaults]
program = "beacon:Beacon"
[agents]
a = {}
b = { parameters = { offset_ms = 5 } }
[media]
radio = { kind = "broadcast_radio", preset = "crazyflie_p2p" }
[[impairments]]
on = "radio: * -> *"
kind = "bernoulli_loss"
loss_ratio = 0.1
[expect]
"count.b.heard" = { min = 1 }
'''
SET = ["--set", "impairments[0].loss_ratio=0.2", "--set", 'expect."count.b.heard".max=1000', "--set",
       "impairments[0]={on='radio: a -> b', kind='bernoulli_loss', loss_ratio=0.9}", "--set",
       "impairments[0].loss_ratio=0.4", "--seed", "8", "--duration", "0.3"]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "beacon.py").write_text(PROGRAM)
    (tmp_path / "beacons.toml").write_text(SCENARIO)
    return tmp_path


def ran(*words: str) -> Any:
    done = CliRunner().invoke(app, ["run", *words, "--host", "inline", "--no-report", "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)["runs"][0]


def test_a_run_is_made_again_from_its_folder(here: Path) -> None:
    first = ran("beacons.toml", *SET, "--out", "first")

    again = ran("first", "--out", "again")

    assert again["summary"]["ledger_hash"] == first["summary"]["ledger_hash"]
    assert (again["summary"]["seed"], again["summary"]["length_ns"]) == (8, 300_000_000)
    assert json.loads((here / "again" / "scenario.json").read_text()) == json.loads(
        (here / "first" / "scenario.json").read_text())
    assert ran("beacons.toml", "--out", "other")["summary"]["ledger_hash"] != first["summary"]["ledger_hash"]


def test_the_changes_are_told_in_an_order_in_which_they_do_the_same(here: Path) -> None:
    ran("beacons.toml", *SET, "--out", "first")

    assert list(made_with(Path("first")).changes.items()) == [
        ('expect."count.b.heard".max', 1000),
        ("impairments[0]", {"on": "radio: a -> b", "kind": "bernoulli_loss", "loss_ratio": 0.9}),
        ("impairments[0].loss_ratio", 0.4), ("seed", 8), ("length_s", 0.3)]


def test_what_is_set_besides_goes_before_what_the_run_was_made_with(here: Path) -> None:
    ran("beacons.toml", *SET, "--out", "first")

    ran("first", "--set", "impairments[0].loss_ratio=0.0", "--seed", "9", "--out", "again")

    scenario = json.loads((here / "again" / "scenario.json").read_text())
    assert (scenario["seed"], scenario["impairments"][0]["fields"], scenario["length_ns"]) == (
        9, {"loss_ratio": 0.0}, 300_000_000)


def test_a_run_under_recorded_fates_is_made_again_under_them(here: Path) -> None:
    """The second run draws nothing: it would lose nothing by itself."""
    ran("beacons.toml", *SET, "--out", "first")
    second = ran("beacons.toml", "--set", "impairments=[]", "--duration", "0.3", "--fates-of", "first", "--match",
                 "instant", "--out", "second")

    again = ran("second", "--out", "again")

    assert second["summary"]["frames"]["lost"] > 5
    assert again["summary"]["frames"] == second["summary"]["frames"]
    assert "by instant" in again["summary"]["replay"]
    assert made_with(Path("again")).words()[-4:] == ["--fates-of", str(here / "first"), "--match", "instant"]


def test_a_run_is_loaded_and_run_again_from_python(here: Path) -> None:
    run = marconet.run(marconet.load("beacons.toml", set={"agents.b.parameters": {"offset_ns": 1_000_000}}, seed=9),
                       host="inline", out="first")

    scenario = marconet.load(run.folder)
    changed = marconet.load(run.folder, set={"agents.b.parameters.offset_ns": 2_000_000}, length_s=0.2)

    assert scenario.seed == changed.seed == 9
    assert marconet.run(scenario, host="inline", out="again").ledger_hash == run.ledger_hash
    assert changed.checked.agents["b"].parameters == {"offset_ns": 2_000_000}
    assert changed.length_s == 0.2


def test_a_folder_that_does_not_tell_is_refused_in_one_line(here: Path) -> None:
    ran("beacons.toml", "--out", "first")
    shutil.copytree(here / "first", here / "old")
    tables = json.loads((here / "old" / "scenario.json").read_text())
    del tables["changes"]
    (here / "old" / "scenario.json").write_text(json.dumps(tables))

    with pytest.raises(ScenarioError, match=r"old: its scenario\.json does not tell what the run was made with"):
        marconet.load("old")
    (here / "beacons.toml").rename(here / "moved.toml")
    done = CliRunner().invoke(app, ["run", "first"])
    assert done.exit_code == 2
    assert done.stderr == (f"first: the scenario of this run, {here / 'beacons.toml'}, is no file: it was moved, or "
                           "built in Python; put it there\n")
