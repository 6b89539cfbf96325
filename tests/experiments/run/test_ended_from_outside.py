"""Ctrl-C, SIGTERM, SIGHUP on a real run with a process for each robot: records are closed, no process is left."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from netem.records.ledger_file import read_metadata
from tests.processes import alive, children

COMMAND = [sys.executable, "-c", "from marconet.command_line import main; main()", "run", "output_sync"]


def nodes_of(pid: int) -> list[int]:
    """The processes of the robots: children of the fork server, which is a child of the emulator."""
    return [node for server in children(pid) for node in children(server)]


def wait_for(condition: Callable[[], bool], seconds: float = 120.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"not within {seconds} s"
        time.sleep(0.005)


def under_way(out: Path, pid: int) -> bool:
    """All robots are there and one has said hello: its log is open and its first thread pool of Zenoh runs."""
    nodes = nodes_of(pid)
    return len(nodes) == 5 and all(len(list(Path(f"/proc/{node}/task").iterdir())) > 2 for node in nodes)


@pytest.mark.parametrize("begun", [True, pytest.param(False, marks=pytest.mark.slow)],
                         ids=["while it runs", "while it starts"])
@pytest.mark.parametrize(("number", "code", "word"), [(signal.SIGINT, 130, "interrupted"),
                                                      (signal.SIGTERM, 143, "terminated"),
                                                      (signal.SIGHUP, 129, "terminal was closed")])
def test_it_closes_its_records_and_leaves_no_process(tmp_path: Path, number: signal.Signals, code: int, word: str,
                                                     begun: bool) -> None:
    out = tmp_path / "run"
    with subprocess.Popen([*COMMAND, "--out", str(out)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          process_group=0) as running:
        wait_for(lambda: under_way(out, running.pid) if begun else len(children(running.pid)) > 0)
        nodes = children(running.pid) + nodes_of(running.pid)
        running.send_signal(number)
        _, told = running.communicate(timeout=120)

    assert running.returncode == code
    assert word in told
    assert str(out) in told
    assert (out / "run.json").is_file()
    assert word in json.loads((out / "summary.json").read_text())["failure"]
    assert (out / "report.html").is_file()
    assert not list(out.glob("*.part"))
    assert "hash" in read_metadata(out / "ledger.parquet")
    assert nodes
    wait_for(lambda: not any(map(alive, nodes)), 5.0)       # one just started ends when it finds its pipe closed
