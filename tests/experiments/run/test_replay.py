"""A run that meets the fates of an earlier one, and trace files made of it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import msgspec
import pytest

from experiments.judge.run_data import load_run
from experiments.judge.trace_files import write_traces
from experiments.run.replay import NoFates, replay_of
from experiments.run.runner import run
from experiments.scenario import load
from netem.records.ledger_file import read_ledger
from tests.experiments.run.fault_bench import Ran
from tests.experiments.run.test_faults_of_carriers import pairs
from tests.experiments.run.test_faults_of_media import BUS, CSMA, SIGHT

MS = 1_000_000
PAIRS = pairs('preset = "crazyflie_p2p"')
PROGRAM = '''
from dataclasses import dataclass

class Beacon:
    @dataclass
    class Settings:
        period_ns: int = 10_000_000
        offset_ns: int = 0
        bytes: int = 8

    def __init__(self, board, settings):
        self.port = board.port("radio", lambda frame: board.count("heard"), listen_only=True)
        board.count("heard", 0)
        board.every(settings.period_ns, lambda: self.port.send(bytes(settings.bytes)), offset_ns=settings.offset_ns)
'''
SCENARIO = '''
# Question: what does another controller do with the same losses?
seed = 3
length_s = 1.0
[agents_defaults]
program = "beacon:Beacon"
[agents]
a = { parameters = { offset_ms = 0 } }
b = { parameters = { offset_ms = 3 } }
c = { parameters = { offset_us = 3050 } }
[media]
radio = { kind = "broadcast_radio", preset = "crazyflie_p2p" }
'''
LOSSES = '''
[[impairments]]
on = "radio: a -> *"
kind = "gilbert_elliott"
loss_ratio = 0.3
mean_burst_frames = 3.0
[[impairments]]
on = "radio: * -> *"
kind = "delay"
distribution = "uniform"
delay_ms = 5
jitter_ms = 4
[[impairments]]
on = "radio: a -> b"
kind = "duplicate"
duplicate_ratio = 0.2
[[faults]]
kind = "kill"
on = "b"
at_s = 0.4
restart_after_s = 0.2
[[faults]]
kind = "link_down"
on = "radio: a -> c"
during_s = [0.7, 0.8]
'''


@pytest.fixture
def scenario(tmp_path: Path) -> Any:
    def written(more: str = "", name: str = "s", base: str = SCENARIO) -> Any:
        (tmp_path / "beacon.py").write_text(PROGRAM)
        (tmp_path / f"{name}.toml").write_text(base + more)
        return load(tmp_path / f"{name}.toml")
    return written


def rows(folder: Path) -> list[dict[str, Any]]:
    return read_ledger(folder / "ledger.parquet").to_pylist()


def fates(folder: Path) -> list[tuple[Any, ...]]:
    return sorted((row["medium"], row["sender"], row["receiver"], row["number"], row["copy"], row["fate"],
                   row["delivered_ns"]) for row in rows(folder))


@pytest.fixture
def old(scenario: Any, tmp_path: Path) -> Path:
    run(scenario(LOSSES), host="inline", out=tmp_path / "old", report=False)
    found = {row["fate"] for row in rows(tmp_path / "old")}
    assert {"delivered", "lost", "cut", "collided", "receiver gone"} <= found
    return tmp_path / "old"


@pytest.mark.parametrize("match", ["number", "instant"])
@pytest.mark.parametrize("host", ["inline", "process"])
def test_the_same_controller_meets_the_same_fates(scenario: Any, old: Path, tmp_path: Path, match: Any,
                                                  host: Any) -> None:
    new = scenario(name="new")                  # without impairments and faults of its own

    result = run(new, host=host, out=tmp_path / "new", report=False, replay=replay_of(old, new, match))

    assert fates(tmp_path / "new") == fates(old)
    assert load_run(tmp_path / "new").counters == load_run(old).counters
    reached = sum(row["fate"] not in ("collided", "deaf") for row in rows(old) if row["copy"] == 0)
    copies = sum(row["fate"] not in ("collided", "deaf") for row in rows(old))
    assert result.summary.replay.startswith(f"{copies} copies as in {old}, by {match}")
    collided = sum(row["fate"] in ("collided", "deaf") for row in rows(old))
    assert f"{collided} recorded frames not met" in result.summary.replay
    assert reached < copies                     # duplicates are met too


@pytest.mark.parametrize(("base", "fault"), [
    (CSMA, 'kind = "jam"\non = "radio"\nduring_s = [0.3, 0.6]\nnodes = ["*"]'),
    (PAIRS, 'kind = "partition"\non = "radio"\nshape = "halves"\nduring_s = [0.30004, 0.6]\ncarriers = "stop"'),
    (SIGHT, 'kind = "noise"\nname = "haze"\non = "view: b -> w"\nduring_s = [0.3, 0.6]\nsigma_m = 0.5'),
    pytest.param(BUS, 'kind = "babble"\non = "can"\nnodes = ["b"]\ncan_id = 0x180\nduring_s = [0.3, 0.5]',
                 marks=pytest.mark.slow)])
def test_faults_of_media_act_again_as_fates_do_not_hold_all_that_they_do(tmp_path: Path, base: str, fault: str) -> None:
    old = Ran(tmp_path / "old", "inline", f"[[faults]]\n{fault}\n", base)
    new = load(tmp_path / "old" / "faults.toml")
    assert new.faults
    new = msgspec.structs.replace(new, faults=())

    run(new, host="inline", out=tmp_path / "new", report=False, replay=replay_of(old.out, new))

    assert fates(tmp_path / "new") == fates(old.out)
    assert [(row["on_air_ns"], row["fate"]) for row in rows(tmp_path / "new")] == [
        (row["on_air_ns"], row["fate"]) for row in old.rows]            # of carriers too, which are no fates
    assert load_run(tmp_path / "new").events == old.data.events         # what sensors told programs is in events
    once = replay_of(tmp_path / "new", new)                             # the faults are in the folder of the replay
    assert [spec.occurrences for spec in once.faults] == [spec.occurrences for spec in replay_of(old.out, new).faults]
    assert once.faults


def test_another_controller_meets_the_losses_of_its_instants(scenario: Any, old: Path, tmp_path: Path) -> None:
    new = scenario(name="new", base=SCENARIO.replace("a = { parameters = { offset_ms = 0 } }",
                                                     "a = { parameters = { offset_ms = 0, period_ms = 5 } }"))
    run(new, host="inline", out=tmp_path / "new", report=False, replay=replay_of(old, new, "instant"))

    cut = {row["number"] for row in rows(tmp_path / "new") if row["fate"] == "cut"}
    recorded = {row["offered_ns"]: row["fate"] for row in rows(old) if (row["sender"], row["receiver"]) == ("a", "c")}
    expected = set()
    for number in range(200):
        nearest = min(recorded, key=lambda at_ns, number=number: (abs(at_ns - 5 * MS * number), at_ns))
        if recorded[nearest] == "cut":
            expected.add(number)
    assert cut == expected != set()


def test_what_has_no_record_passes_and_is_counted(scenario: Any, old: Path, tmp_path: Path) -> None:
    new = scenario(name="new", base=SCENARIO.replace("length_s = 1.0", "length_s = 1.2"))

    result = run(new, host="inline", out=tmp_path / "new", report=False, replay=replay_of(old, new))

    late = [row for row in rows(tmp_path / "new") if row["offered_ns"] >= 1000 * MS and row["fate"] == "delivered"]
    assert len(late) == 40                      # of a; b and c are on the air together
    assert f"{len(late)} without a record" in result.summary.replay


def test_a_run_of_other_robots_is_refused(scenario: Any, old: Path, tmp_path: Path) -> None:
    other = scenario(name="other", base=SCENARIO.replace("\na = ", "\nx = ").replace("\nb = ", "\ny = ")
                     .replace("\nc = ", "\nz = "))

    with pytest.raises(NoFates, match=r"old: has fates for radio: . -> ., .* and 3 more links, and other has none"):
        replay_of(old, other)
    with pytest.raises(NoFates, match=r"cannot read its ledger\.parquet"):
        replay_of(tmp_path / "nothing", other)


@pytest.mark.parametrize("by", ["frame", "time"])
def test_trace_files_repeat_losses_and_delays(scenario: Any, tmp_path: Path, by: Any) -> None:
    losses = LOSSES.partition("[[impairments]]\non = \"radio: a -> b\"")[0]
    local = SCENARIO.replace('preset = "crazyflie_p2p"', 'preset = "crazyflie_p2p", decode = "local"')
    run(scenario(losses, base=local), host="inline", out=tmp_path / "old", report=False)
    *_, toml = write_traces(tmp_path / "old", tmp_path, by)
    new = scenario(toml.read_text(), name="new", base=local)

    run(new, host="inline", out=tmp_path / "new", report=False)

    def ends(folder: Path) -> list[tuple[Any, ...]]:
        return sorted((row["sender"], row["receiver"], row["number"], row["fate"] == "delivered")
                      for row in rows(folder) if row["offered_ns"] < 980 * MS and row["fate"] != "unfinished")
    assert ends(tmp_path / "new") == ends(tmp_path / "old")
    late = {(row["sender"], row["receiver"], row["number"]): row["delivered_ns"] for row in rows(tmp_path / "old")}
    apart = {late[row["sender"], row["receiver"], row["number"]] - row["delivered_ns"] for row in rows(tmp_path / "new")
             if row["receiver"] == "b" and row["sender"] == "a" and row["fate"] == "delivered"}
    assert max(apart) - min(apart) <= 1         # the shortest delay of the link is missing everywhere; CSV has 1 ns


def test_the_command_line_tells_what_was_met(scenario: Any, old: Path, tmp_path: Path) -> None:
    scenario(name="new")
    command = [sys.executable, "-m", "marconet.command_line"]
    told = subprocess.run([*command, "run", str(tmp_path / "new.toml"), "--host", "inline", "--no-report", "--fates-of",
                           str(old), "--out", str(tmp_path / "new")], capture_output=True, text=True, check=False)

    assert told.returncode == 0
    assert "copies as in" in told.stdout.replace("\n", " ")
    exported = subprocess.run([*command, "export", str(old), "--as", "traces", "--out", str(tmp_path / "t")],
                              capture_output=True, text=True, check=False)
    assert (exported.returncode, (tmp_path / "t" / "radio-a-b.csv").is_file()) == (0, True)
    refused = subprocess.run([*command, "export", str(tmp_path), "--as", "traces", "--out", str(tmp_path / "u")],
                             capture_output=True, text=True, check=False)
    assert refused.returncode == 2
    assert "no run was recorded there" in refused.stderr
