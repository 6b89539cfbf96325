"""Faults that are injected into a run in real time, by real processes, and the schedule that repeats them."""

from __future__ import annotations

import stat
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import marconet
from experiments.judge.run_data import load_run
from experiments.judge.run_files import SCENARIO as SCENARIO_FILE
from experiments.run.injection import NotInjected, inject
from experiments.run.replay import replay_of
from experiments.run.run_folder import RunFolder
from experiments.run.run_records import FolderRecords
from experiments.run.runner import run
from experiments.scenario import load
from experiments.search.shrink import shrink
from netem.records.ledger_file import read_ledger, read_metadata
from tests.experiments.run.fault_bench import PROGRAM, SCENARIO

LONG = SCENARIO.replace("length_s = 1.0", "length_s = 6.0")
MARCONET = [sys.executable, "-m", "marconet.command_line"]


def wait_for(path: Path) -> None:
    until_s = time.monotonic() + 60
    while not path.exists():
        assert time.monotonic() < until_s, f"{path} does not come"
        time.sleep(0.02)


def fates_in(folder: Path) -> list[tuple[Any, ...]]:
    return [(row["sender"], row["receiver"], row["number"], row["fate"], row["delivered_ns"])
            for row in read_ledger(folder / "ledger.parquet").to_pylist()]


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    (tmp_path / "beacon.py").write_text(PROGRAM)
    (tmp_path / "faults.toml").write_text(LONG)
    return tmp_path / "faults.toml"


@pytest.fixture
def running(scenario: Path) -> Iterator[tuple[Path, subprocess.Popen[str]]]:
    """A run in real time that has begun, and its process."""
    out = scenario.parent / "run"
    with in_real_time(scenario, out) as process:
        yield out, process


@contextmanager
def in_real_time(scenario: Path, out: Path) -> Iterator[subprocess.Popen[str]]:
    code = ("import sys; from pathlib import Path; from experiments.run.runner import run; from experiments.scenario "
            "import load; run(load(Path(sys.argv[1])), host='process', out=Path(sys.argv[2]), real_time=True, "
            "report=False)")
    process = subprocess.Popen([sys.executable, "-c", code, str(scenario), str(out)], text=True,
                               stderr=subprocess.PIPE)
    try:
        wait_for(out / "run.faults")
        yield process
    finally:
        process.kill()
        process.wait()


def test_what_was_injected_repeats_the_run_in_virtual_time(running: tuple[Path, subprocess.Popen[str]],
                                                           scenario: Path) -> None:
    out, process = running
    assert stat.S_IMODE((out / "run.faults").stat().st_mode) & 0o077 == 0
    name, at_s = marconet.fault(out, "kill", on="b", restart_after_s=0.5)
    said = subprocess.run([*MARCONET, "fault", str(out), "link_down", "on=radio: a -> c", "lasts_s=0.3"],
                          capture_output=True, text=True, timeout=60, check=False)
    marconet.fault(out, "link_down", on="radio: c -> b", lasts_s=0.3, carriers="stop")
    marconet.fault(out, "plant_parameter", on="b", variable="gain_left", factor=0.5)
    with pytest.raises(ValueError, match="no such kind; did you mean \"kill\""):
        marconet.fault(out, "kil", on="b")
    with pytest.raises(ValueError, match="names no node of the scenario"):
        marconet.fault(out, "kill", on="z")
    with pytest.raises(ValueError, match="begins at once"):
        marconet.fault(out, "kill", on="b", at_s=1.0)

    assert said.returncode == 0, said.stderr
    assert said.stdout.startswith("injected-1: link_down at ")
    _, problems = process.communicate(timeout=60)
    assert process.returncode == 0, problems
    assert not (out / "run.faults").exists()
    with pytest.raises(ValueError, match="the run has ended"):
        marconet.fault(out, "kill", on="b")

    live = read_metadata(out / "ledger.parquet")["hash"]
    fates = {row["fate"] for row in read_ledger(out / "ledger.parquet").to_pylist()}
    assert {"receiver gone", "cut"} <= fates
    again = scenario.with_name("again.toml")
    again.write_text(LONG + (out / "injected.toml").read_text())
    for host in ("inline", "process"):
        run(load(again), host=host, out=scenario.parent / host, report=False)       # type: ignore[arg-type]
        assert read_metadata(scenario.parent / host / "ledger.parquet")["hash"] == live
    told = load_run(out).scenario["faults"]
    assert told == load_run(scenario.parent / "inline").scenario["faults"]
    assert [fault["kind"] for fault in told] == ["kill", "link_down", "link_down", "plant_parameter"]
    run(load(scenario), host="inline", out=scenario.parent / "replayed", report=False,
        replay=replay_of(out, load(scenario)))
    assert fates_in(scenario.parent / "replayed") == fates_in(out)
    assert name == "injected-0"
    assert at_s < 6


@pytest.mark.slow
def test_shrink_leaves_of_the_injected_faults_the_one_that_matters(scenario: Path) -> None:
    scenario.write_text(SCENARIO.replace("length_s = 1.0", "length_s = 2.0")
                        + '[expect]\n"frames_cut" = { max = 0 }\n')
    out = scenario.parent / "run"
    with in_real_time(scenario, out) as process:
        marconet.fault(out, "clock_step", on="c", by_ms=3)
        _, at_s = marconet.fault(out, "link_down", on="radio: a -> b", lasts_s=0.2)
        _, problems = process.communicate(timeout=60)
    assert process.returncode == 0, problems

    small = shrink(out, most_runs=40, out=scenario.with_name("small.toml"))

    kept, = tomllib.loads(scenario.with_name("small.toml").read_text())["faults"]
    assert (kept["kind"], kept["on"]) == ("link_down", "radio: a -> b")
    assert kept["during_s"] == pytest.approx([at_s, at_s + 0.2], abs=1e-9)
    assert small.expectation == "frames_cut"
    repeated = run(marconet.load(out).checked, host="inline", out=scenario.parent / "again", report=False)
    assert repeated.summary.ledger_hash == read_metadata(out / "ledger.parquet")["hash"]


@pytest.mark.parametrize(("words", "line"), [
    (["nowhere", "kill", "on=b"], "nowhere: there is no run in this folder"),
    (["ended", "kill", "on=b"], "ended: the run has ended"),
    (["ended", "kill", "b"], "b: expected key=value, as in on=r3 or lasts_s=1.5")])
def test_a_mistake_is_one_clear_line(scenario: Path, words: list[str], line: str) -> None:
    scenario.write_text(SCENARIO.replace("length_s = 1.0", "length_s = 0.1"))
    run(load(scenario), host="inline", out=scenario.parent / "ended", report=False)

    said = subprocess.run([*MARCONET, "fault", *words], cwd=scenario.parent, capture_output=True, text=True, timeout=60,
                          check=False)

    assert said.returncode == 2
    assert said.stderr.splitlines() == [f"error: {line}"] or said.stderr.strip().endswith(line)


ASKS = '''
from pathlib import Path
from experiments.judge.run_files import SCENARIO as SCENARIO_FILE
from experiments.run.injection import NotInjected, inject

def asked(folder):
    try:
        return inject(Path(folder), "kill", {"on": "a"})
    except NotInjected as refusal:
        return str(refusal)

class Asks:
    def __init__(self, board):
        Path("said").write_text(asked("run"))
        board.port("radio", listen_only=True)
'''
ASKING = '''
seed = 1
length_s = 0.01
agents = { a = { program = "asks:Asks" }, b = { program = "asks:Asks" } }
media = { radio = { kind = "broadcast_radio", preset = "crazyflie_p2p" } }
'''


def test_a_run_that_is_starting_or_ending_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("asks.py").write_text(ASKS)
    Path("asking.toml").write_text(ASKING)
    at_report = []

    def write_report(records: FolderRecords) -> None:
        with pytest.raises(NotInjected) as refusal:
            inject(records.folder, "kill", {"on": "a"})
        at_report.append(str(refusal.value))

    monkeypatch.setattr(FolderRecords, "write_report", write_report)
    run(load(Path("asking.toml")), host="inline", out=Path("run"), real_time=True)

    assert Path("said").read_text() == "run: the run is starting: its robots are not ready yet; try again"
    assert at_report == ["run: the run is ending: its robots have stopped, and it takes no more faults"]
    assert [path.name for path in Path("run").glob("run.*")] == ["run.json"]


def test_a_run_in_virtual_time_without_a_view_says_what_it_needs_to_take_faults(tmp_path: Path) -> None:
    folder = RunFolder.claim(tmp_path / "run")
    SCENARIO_FILE.write(folder.path, {})

    with pytest.raises(NotInjected, match="not in real time: start it with --real-time, or with --view, to inject"):
        inject(folder.path, "kill", {"on": "a"})
    folder.release()
