"""Whatever ends a run, its records up to there can be read: on both hosts, by signals, crashes and a full disk."""

from __future__ import annotations

import json
import os
import re
import resource
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from experiments.judge.run_data import load_run
from netem.records.ledger_file import hash_of, read_ledger, read_metadata
from tests.processes import children

CASES = Path(__file__).parents[2] / "cases" / "robots_that_misbehave"
MARCONET = [sys.executable, "-c", "from marconet.command_line import main; main()"]
PROGRAM = '''
class Beacon:
    def __init__(self, board):
        self.board = board
        self.radio = board.port("radio", lambda frame: board.count("heard"), listen_only=True)
        board.record("sent", "1", lambda: board.now_ns / 10_000_000)
        board.every(10_000_000, self.say)

    def say(self):
        self.radio.send(bytes(8))
        self.board.event("spoke")
'''
FOREVER = '''
# Question: what is left?
seed = 7
length_s = 1e5
[agents.r1]
program = "beacon:Beacon"
[agents.r2]
program = "beacon:Beacon"
clock = { offset_us = 5000 }
[media.radio]
kind = "broadcast_radio"
preset = "crazyflie_p2p"
'''


@pytest.fixture
def forever(tmp_path: Path) -> Path:
    (tmp_path / "beacon.py").write_text(PROGRAM)
    (tmp_path / "forever.toml").write_text(FOREVER)
    return tmp_path / "forever.toml"


def start(scenario: Path, out: Path, *options: str) -> subprocess.Popen[str]:
    return subprocess.Popen([*MARCONET, "run", str(scenario), "--out", str(out), *options], stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True, process_group=0, env={**os.environ, "RUN": str(out)})


def wait_for(condition: Callable[[], bool], seconds: float = 120.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"not within {seconds} s"
        time.sleep(0.01)


def under_way(out: Path) -> bool:
    """A second and more of every record is on the disk: how far the run came is written last."""
    try:
        return bool(json.loads((out / "run.json.part").read_bytes())["reached_ns"] > 1e9)
    except (FileNotFoundError, json.JSONDecodeError):
        return False


def summary_of(out: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((out / "summary.json").read_text())
    return found


def assert_whole(out: Path) -> None:
    """The records are there, agree with each other, and no part of one is left."""
    assert {file.name for file in out.iterdir()} - {"logs"} == {
        "scenario.json", "ledger.parquet", "ledger_events.parquet", "signals.mcap", "run.json", "summary.json",
        "report.html"}
    assert hash_of(out / "ledger.parquet") == read_metadata(out / "ledger.parquet")["hash"]
    data = load_run(out)
    assert data.missing == []
    assert 0 < data.length_ns < 1e14
    assert data.signals["r1"].time_ns.size > 0
    assert len(data.events) > 0


slow = pytest.mark.slow


@pytest.mark.parametrize(("host", "presses"), [("process", 3), pytest.param("inline", 3, marks=slow),
                                               pytest.param("process", 1, marks=slow),
                                               pytest.param("inline", 1, marks=slow)])
def test_a_second_and_a_third_interrupt_cut_no_record_off(tmp_path: Path, forever: Path, host: str, presses: int
                                                          ) -> None:
    out = tmp_path / "run"
    with start(forever, out, "--host", host) as running:
        wait_for(lambda: under_way(out))
        for _ in range(presses):
            running.send_signal(signal.SIGINT)
            time.sleep(0.02)
        _, told = running.communicate(timeout=120)

    assert (running.returncode, "interrupted (SIGINT)" in told) == (130, True)
    assert_whole(out)
    assert summary_of(out)["failure"] == "interrupted (SIGINT)"
    delivered = read_ledger(out / "ledger.parquet")["fate"].to_pylist().count("delivered")
    counted = sum(count["heard"] for count in load_run(out).counters.values())
    assert abs(counted - delivered) <= 4        # what was delivered in the last window may not have been heard yet
    assert "interrupted" in (out / "report.html").read_text()


@pytest.mark.parametrize("host", ["process", pytest.param("inline", marks=slow)])
def test_after_a_kill_the_report_makes_records_of_what_is_on_the_disk(tmp_path: Path, forever: Path, host: str) -> None:
    out = tmp_path / "run"
    with start(forever, out, "--host", host) as running:
        wait_for(lambda: under_way(out) and b'"heard"' in (out / "run.json.part").read_bytes())
        emulator = running.pid if host == "process" else children(running.pid)[0]
        subprocess.run(["kill", "-KILL", str(emulator)], check=True)
        running.communicate(timeout=120)
    if host == "process":
        done = subprocess.run([*MARCONET, "report", str(out)], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")

    assert running.returncode == (-signal.SIGKILL if host == "process" else 3)
    assert_whole(out)
    assert all(count["heard"] > 0 for count in load_run(out).counters.values())
    assert ("was killed" if host == "process" else "was ended by SIGKILL") in summary_of(out)["failure"]


@pytest.mark.parametrize(("case", "what"), [
    ("Segv", "was ended by SIGSEGV"), ("OsExit", "exited with code 7"),
    pytest.param("BaseExc", "Weird: weird", marks=slow), pytest.param("KbdInt", "KeyboardInterrupt", marks=slow),
    pytest.param("OsExit0", "exited with code 0", marks=slow),
    pytest.param("InitOsExit", "exited with code 9", marks=slow),
    pytest.param("SysExit0", "SystemExit: 0", marks=slow), pytest.param("Abort", "was ended by SIGABRT", marks=slow)])
def test_a_program_that_ends_an_inline_run_has_failed(tmp_path: Path, case: str, what: str) -> None:
    out = tmp_path / "run"
    with start(CASES / f"{case}.toml", out, "--host", "inline") as running:
        _, told = running.communicate(timeout=120)

    assert running.returncode == 3
    assert "node bad" in told
    assert what in told
    assert what in summary_of(out)["failure"]
    assert load_run(out).missing == []
    assert "node bad" in (out / "report.html").read_text()
    if case in ("Segv", "BaseExc"):             # the line of the program
        assert re.search(r'robots\.py", line \d+,? in act', told)


def test_what_a_program_leaves_running_ends_with_an_inline_run(tmp_path: Path) -> None:
    with start(CASES / "Forks.toml", tmp_path / "run", "--host", "inline") as running:
        running.communicate(timeout=120)         # ends when every process has closed these pipes

    assert running.returncode == 0


@pytest.mark.slow
def test_a_forked_copy_of_the_emulator_does_not_touch_the_records(tmp_path: Path) -> None:
    hashes = []
    for case in ("Good", "ForkChildReturns"):
        with start(CASES / f"{case}.toml", tmp_path / case, "--host", "inline") as running:
            running.communicate(timeout=120)
        hashes.append(summary_of(tmp_path / case)["ledger_hash"])

    assert hashes[0] == hashes[1] == hash_of(tmp_path / "ForkChildReturns" / "ledger.parquet")


def test_a_run_ends_when_its_small_parent_is_killed(tmp_path: Path) -> None:
    out = tmp_path / "run"
    # 1 s of robot time would be over, with compiled modules after 2 ms, before the parent's death is known
    with start(CASES / "KillParent.toml", out, "--host", "inline", "--set", "length_s=100") as running:
        running.communicate(timeout=120)         # the child holds these pipes to its end

    assert running.returncode == -signal.SIGKILL
    assert summary_of(out)["failure"] == "terminated (SIGTERM)"


@pytest.mark.parametrize("case", ["OsExit", pytest.param("SysExit", marks=slow), pytest.param("BaseExc", marks=slow)])
def test_a_node_that_fails_leaves_records_with_its_last_report(tmp_path: Path, case: str) -> None:
    out = tmp_path / "run"
    with start(CASES / f"{case}.toml", out) as running:
        _, told = running.communicate(timeout=120)

    assert running.returncode == 3
    assert "node bad" in told
    summary = summary_of(out)
    assert "node bad" in summary["failure"]
    assert "had run up to" in summary["last_report"]
    assert load_run(out).missing == []
    assert load_run(out).counters["good"] is not None
    assert "node bad" in (out / "report.html").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("host", ["inline", pytest.param("process", marks=slow)])
def test_on_a_full_disk_what_was_written_before_can_be_read(tmp_path: Path, forever: Path, host: str) -> None:
    out = tmp_path / "run"
    with start(forever, out, "--host", host) as running:
        wait_for(lambda: under_way(out))
        fullest = max(file.stat().st_size for file in out.glob("*.part"))       # a file grows no further
        for pid in [running.pid] + (children(running.pid) if host == "inline" else []):
            resource.prlimit(pid, resource.RLIMIT_FSIZE, (fullest, fullest))
        _, told = running.communicate(timeout=120)

    assert_told_and_readable(out, running.returncode, told, "File too large")


@slow
@pytest.mark.parametrize("host", ["inline", "process"])
def test_on_a_file_system_that_is_full_what_was_written_before_can_be_read(small_disk: Path, forever: Path, host: str
                                                                           ) -> None:
    out = small_disk / "run"
    with start(forever, out, "--host", host) as running:
        wait_for(lambda: under_way(out))
        with suppress(OSError), (small_disk / "filler").open("wb", buffering=0) as filler:
            while filler.write(bytes(4096)):
                pass
        _, told = running.communicate(timeout=120)
    (small_disk / "filler").unlink()

    assert_told_and_readable(out, running.returncode, told, "No space left on device")


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 16 MB in memory."""
    place = tmp_path / "disk"
    place.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=16m", "marconet-test", str(place)],
                             capture_output=True, text=True, check=False)
    if mounted.returncode:
        pytest.skip(f"a small tmpfs cannot be mounted here, which root may do: {mounted.stderr.strip()}")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


def assert_told_and_readable(out: Path, code: int, told: str, why: str) -> None:
    report = subprocess.run([*MARCONET, "report", str(out)], capture_output=True, text=True, check=False)

    assert code == 2
    assert f"{out}: cannot write the records: {why}: free space, or name another folder" in told
    assert "cannot write the records" in summary_of(out)["failure"]
    assert (report.returncode, report.stderr) == (0, "")
    assert not list(out.glob("*.rows.part"))
    assert read_ledger(out / "ledger.parquet").num_rows > 10
    assert load_run(out).signals["r1"].time_ns.size > 5


def test_after_a_crash_the_next_scenarios_of_an_inline_call_run_all_the_same(tmp_path: Path) -> None:
    files = [str(CASES / f"{case}.toml") for case in ("Segv", "OsExit0", "Good")]
    done = subprocess.run([*MARCONET, "run", *files, "--host", "inline", "--out", str(tmp_path / "runs"), "--json",
                           "--junit", str(tmp_path / "junit.xml")], capture_output=True, text=True, check=False)

    document = json.loads(done.stdout)
    assert (done.returncode, document["exit_code"]) == (3, 3)
    told = [(run["scenario"], run["exit_code"]) for run in document["runs"]]
    assert told == [("Segv", 3), ("OsExit0", 3), ("Good", 0)]
    assert "was ended by SIGSEGV" in document["runs"][0]["problems"][0]
    assert document["runs"][2]["summary"]["ledger_hash"] == summary_of(tmp_path / "runs" / "Good")["ledger_hash"]
    suites = ElementTree.parse(tmp_path / "junit.xml").getroot().findall("testsuite")
    assert [(suite.get("name"), suite.get("errors")) for suite in suites] == [("Segv", "1"), ("OsExit0", "1"),
                                                                              ("Good", "0")]
    for case in ("Segv", "OsExit0"):
        assert summary_of(tmp_path / "runs" / case)["failure"]


@pytest.mark.parametrize(("case", "host"), [("CloseStd", "inline"), ("ForksAndRaisesWhileBuilt", "process"),
                                            *(pytest.param(*case, marks=slow) for case in (
                                                ("Daemonizes", "process"), ("Forks", "process"),
                                                ("ForkChildRaises", "process"),
                                                ("ForksWhileBuilt", "process"), ("Daemonizes", "inline"),
                                                ("SetSid", "process"), ("SetSid", "inline")))])
def test_what_harms_nobody_ends_with_0_and_leaves_no_process(tmp_path: Path, case: str, host: str) -> None:
    with start(CASES / f"{case}.toml", tmp_path / "run", "--host", host) as running:
        running.communicate(timeout=120)

    assert running.returncode == 0
    assert summary_of(tmp_path / "run")["failure"] == ""
    assert [pid for pid in processes_that_name(str(tmp_path / "run")) if pid != running.pid] == []
    assert load_run(tmp_path / "run").counters["good"] is not None


def test_a_program_that_closes_every_file_leaves_the_records_whole(tmp_path: Path) -> None:
    out = tmp_path / "run"
    with start(CASES / "CloseAllFds.toml", out, "--host", "inline") as running:
        _, told = running.communicate(timeout=120)

    assert running.returncode == 3
    assert "a robot program closed files of the emulator" in told
    assert "a robot program closed files of the emulator" in summary_of(out)["failure"]
    assert read_ledger(out / "ledger.parquet").num_rows == 200     # 100 frames of two robots in 1 s
    assert not list(out.glob("*.part"))


def processes_that_name(text: str) -> list[int]:
    """Ids of the processes that inherited this text in their environment."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if text.encode() in (place / "environ").read_bytes():
                found.append(int(place.name))
    return found


