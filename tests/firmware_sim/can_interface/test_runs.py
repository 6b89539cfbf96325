"""Whole runs: the example of docs/python_can.md on `marconet` and, unmodified, on python-can's `virtual`."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from experiments.run.runner import run
from experiments.scenario import load
from netem.wire.errors import NodeFailure

PAGE = Path(__file__).parents[3] / "docs" / "python_can.md"
FILES = dict(re.findall(r"^`([\w.]+)`, [^\n]*:\n\n```\w*\n(.*?)^```", PAGE.read_text(encoding="utf-8"),
                        re.DOTALL | re.MULTILINE))

# Both programs in one process on python-can's own bus: its time is the wall's, so nothing below may depend on it.
ON_VIRTUAL = """
import contextlib, io, json, sys, threading, time
sys.path.insert(0, sys.argv[1])
import companion, drive
from can.interfaces.virtual import channels

said = {}

class PerThread(io.TextIOBase):
    def write(self, text):
        said[threading.current_thread().name] = said.get(threading.current_thread().name, "") + text
        return len(text)

with contextlib.redirect_stdout(PerThread()):
    other = threading.Thread(target=drive.main, args=("virtual",), kwargs={"stale_s": 2.0}, name="drive")
    other.start()
    while not channels.get("can0"):
        time.sleep(0.01)
    threading.current_thread().name = "companion"
    companion.main("virtual")
    other.join()
print(json.dumps(said))
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def printed(folder: Path, node: str) -> str:
    return (folder / "out" / "logs" / f"{node}.log").read_text()


def test_the_page_has_its_four_files() -> None:
    assert set(FILES) == {"drive.dbc", "companion.py", "drive.py", "drive_on_can.toml"}
    assert "marconet" not in FILES["companion.py"] + FILES["drive.py"]


def test_a_program_does_the_same_on_marconet_as_on_virtual(folder: Path) -> None:
    result = run(load(folder / "drive_on_can.toml"), out=folder / "out", report=False)

    theirs = json.loads(subprocess.run([sys.executable, "-c", ON_VIRTUAL, str(folder)], capture_output=True, text=True,
                                       check=True, timeout=60).stdout)
    assert [verdict.key for verdict in result.summary.verdicts if not verdict.holds] == []
    assert printed(folder, "companion") == theirs["companion"]
    assert printed(folder, "drive") == theirs["drive"]
    assert theirs["companion"].count(" m, ") == 20
    assert theirs["drive"].endswith("nothing heard: motors off\n")


@pytest.mark.slow
def test_two_runs_give_one_hash(folder: Path) -> None:
    scenario = load(folder / "drive_on_can.toml", duration_s=0.3, overrides=["expect={}"])

    hashes = {run(scenario, out=folder / str(order), report=False, shuffle_start=order).summary.ledger_hash
              for order in range(2)}

    assert len(hashes) == 1
    shorter = load(folder / "drive_on_can.toml", duration_s=0.2, overrides=["expect={}"])
    assert run(shorter, out=folder / "shorter", report=False).summary.ledger_hash not in hashes


THREADED = '''
import sys
import time
from threading import Lock, Thread

import can


def main():
    """python-can was imported by this program, so all of it finds virtual time."""
    reader, lock = can.BufferedReader(), Lock()
    with can.Bus(interface="marconet") as bus, can.Notifier(bus, [reader]):
        print(reader.get_message(timeout=0.25), time.time(), "virtual" in repr(lock))
        print(reader.get_message(timeout=1.0).arbitration_id, round(time.time(), 2))
        try:
            time.sleep(100.0)
        finally:
            print("cleaned up at", time.time())


def other():
    time.sleep(0.5)
    with can.Bus(interface="marconet") as bus:
        bus.send(can.Message(arbitration_id=7, is_extended_id=False))


def fails():
    time.sleep(0.125)
    raise LookupError("no such map")


def gives_up():
    Thread(target=time.sleep, args=(100.0,)).start()
    time.sleep(0.125)
    sys.exit("I give up")
'''
SCENARIO = """
# Question: does it run?
seed = 1
length_s = 1.5
[agents.a]
program = "threaded_of_the_tests:main"
[agents.b]
program = "threaded_of_the_tests:other"
[media.can0]
kind = "can"
bit_rate_bps = 500_000
"""


@pytest.fixture
def threaded(tmp_path: Path) -> Path:
    (tmp_path / "threaded_of_the_tests.py").write_text(THREADED)
    (tmp_path / "threaded.toml").write_text(SCENARIO)
    return tmp_path


def test_a_process_has_all_of_python_can_in_virtual_time_and_cleans_up_at_the_end(threaded: Path) -> None:
    run(load(threaded / "threaded.toml"), out=threaded / "out", report=False)

    assert printed(threaded, "a").splitlines() == ["None 0.25 True", "7 0.5", "cleaned up at 1.5"]


def test_a_program_that_fails_is_named_with_its_traceback(threaded: Path) -> None:
    scenario = load(threaded / "threaded.toml", overrides=['agents.b.program="threaded_of_the_tests:fails"'])

    with pytest.raises(NodeFailure) as caught:
        run(scenario, out=threaded / "out", report=False)

    assert caught.value.node == "b"
    assert caught.value.reason == "its program failed at 125000000 ns: LookupError: no such map"
    assert re.search(r'threaded_of_the_tests\.py", line \d+, in fails\n    raise LookupError\("no such map"\)',
                     caught.value.detail)


def test_a_program_that_gives_up_ends_its_process_though_a_thread_of_it_waits(threaded: Path) -> None:
    scenario = load(threaded / "threaded.toml", overrides=['agents.b.program="threaded_of_the_tests:gives_up"'])

    with pytest.raises(NodeFailure, match="b: its program failed at 125000000 ns: SystemExit: I give up") as caught:
        run(scenario, out=threaded / "out", report=False)

    assert 'sys.exit("I give up")' in caught.value.detail
