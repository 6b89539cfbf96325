"""`marconet.break_scenario` and `marconet.shrink`: the same searches as those of the commands, from Python."""

from __future__ import annotations

import json
import subprocess
import sys
from math import inf
from pathlib import Path

import pytest

import marconet

PROGRAM = '''
class Beacon:
    def __init__(self, board):
        self.radio = board.port("radio", listen_only=True)
        board.every(50_000_000, lambda: self.radio.send(b"here"))


class Listener:
    """Stops for good if it hears nothing for more than 170 ms."""

    def __init__(self, board):
        self.board, self.heard_ns, self.speed = board, 0, 1.0
        board.port("radio", self.hear, listen_only=True)
        board.every(10_000_000, self.look)
        board.record("speed", "m/s", lambda: self.speed)

    def hear(self, frame):
        self.heard_ns = self.board.now_ns

    def look(self):
        if self.board.now_ns - self.heard_ns > 170_000_000:
            self.speed = 0.0
'''
SCENARIO = '''
# Question: does it keep on driving?
seed = 2
length_s = 1.5
[agents]
beacon = { program = "of_searching:Beacon" }
listener = { program = "of_searching:Listener" }
[media]
radio = { kind = "broadcast_radio", preset = "crazyflie_p2p" }
[expect]
drives = "always listener.speed > 0.5 m/s"
'''
BUDGET = "radio: beacon -> listener: at most 3 lost of 10"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "of_searching.py").write_text(PROGRAM)
    (tmp_path / "steered.toml").write_text(SCENARIO)
    return tmp_path


def test_the_worst_is_found_run_and_made_smaller(here: Path) -> None:
    worst = marconet.break_scenario(marconet.load("steered.toml", set={"sample_period_ms": 5}), BUDGET,
                                    minimize="drives", runs=24, jobs=1, length_s=1.2)

    assert (worst.value, worst.without, worst.holds, len(worst.costs)) == (-0.5, 0.5, False, 24)
    assert min(worst.costs) == worst.value
    assert inf not in worst.costs
    assert worst.file == here / "steered_worst.toml"
    assert worst.scenario is not None
    assert "drives is -0.5, 0.5 without; scenario " in repr(worst)
    run = marconet.run(worst.scenario, host="inline")
    assert run.first_violation().startswith("drives is -0.5")

    smallest = marconet.shrink(run, out="small.toml")

    assert smallest.expectation == "drives"
    assert len(smallest.kept) == 3 < smallest.of
    assert smallest.minimal
    assert smallest.length_s < 1.2
    # It tells the same as the command about the same run.
    told = subprocess.run([sys.executable, "-m", "marconet.command_line", "shrink", str(run.folder), "--json"],
                          capture_output=True, text=True, check=True)
    document = json.loads(told.stdout)
    assert (document["kept"], document["length_s"], document["runs"], document["of"]) == (
        smallest.kept, smallest.length_s, smallest.runs, smallest.of)
    assert smallest.scenario.resolved()["sample_period_ns"] == 5_000_000
    assert not marconet.run(smallest.scenario, host="inline").holds


def test_nothing_worse_is_told(here: Path) -> None:
    worst = marconet.break_scenario("steered.toml", "radio: beacon -> listener: at most 1 lost in a row",
                                    minimize="drives", runs=3, jobs=1)

    assert (worst.file, worst.scenario, worst.pattern) == (None, None, [])
    assert repr(worst) == "<marconet.Worst: drives is 0.5, and nothing worse in 3 runs>"


def test_what_cannot_be_searched_is_refused(here: Path) -> None:
    built = marconet.Scenario("built", seed=1, length_s=0.1, agents={"beacon": {"program": "of_searching:Beacon"}},
                              media={"radio": {"kind": "broadcast_radio"}})

    with pytest.raises(ValueError, match="built: was built in Python: a search needs the file of a scenario"):
        marconet.break_scenario(built, BUDGET, minimize="drives")
    with pytest.raises(ValueError, match="what is the search to make worse"):
        marconet.break_scenario("steered.toml", BUDGET)
    with pytest.raises(ValueError, match="every expectation holds, so there is no failure to make smaller"):
        marconet.shrink(marconet.run("steered.toml", host="inline"))
    with pytest.raises(ValueError, match=r"nowhere: cannot read scenario\.json and summary\.json of a run there"):
        marconet.shrink("nowhere")
