"""The fork server and the emulator's end of it, with real processes."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from netem.transport.node_processes import NodeProcesses

SERVER = """
import os, sys
from netem.transport.fork_server import serve

def life():
    word = sys.stdin.readline().strip()
    if word == "crash":
        os.abort()
    print("was told", word, os.getpgid(0) == os.getpid(), open("/proc/self/comm").read().strip())
    return int(word)

sys.exit(serve(life))
"""


@pytest.fixture
def processes(tmp_path: Path) -> Iterator[NodeProcesses]:
    found = NodeProcesses([sys.executable, "-c", SERVER], tmp_path / "server.log", os.environ)
    yield found
    found.close(5.0)


def ended(processes: NodeProcesses, node: str) -> int:
    deadline_s = time.monotonic() + 20
    while (code := processes.exit_code(node)) is None:
        assert time.monotonic() < deadline_s, f"{node} does not end"
        time.sleep(0.005)
    return code


def test_each_node_has_its_own_input_log_group_name_and_exit_code(processes: NodeProcesses, tmp_path: Path) -> None:
    for name, word in (("left", "3"), ("right", "0")):
        with processes.start(name, tmp_path / f"{name}.log") as standard_input:
            standard_input.write(f"{word}\n".encode())

    codes = [ended(processes, name) for name in ("left", "right")]

    assert codes == [3, 0]
    assert (tmp_path / "left.log").read_text() == "was told 3 True left\n"
    assert (tmp_path / "right.log").read_text() == "was told 0 True right\n"


def test_a_node_that_a_signal_ends_is_told_by_its_number(processes: NodeProcesses, tmp_path: Path) -> None:
    with processes.start("left", tmp_path / "left.log") as standard_input:
        standard_input.write(b"crash\n")
    with processes.start("right", tmp_path / "right.log"):
        code = ended(processes, "left")
        processes.kill("right")
        killed = ended(processes, "right")

    assert (code, killed) == (-6, -9)


def test_closing_ends_a_node_that_does_not_end_by_itself(tmp_path: Path) -> None:
    processes = NodeProcesses([sys.executable, "-c", SERVER], tmp_path / "server.log", os.environ)
    with processes.start("left", tmp_path / "left.log"):
        while "left" not in processes.pids():
            time.sleep(0.005)
        pid = processes.pids()["left"]

        processes.close(0.2)

    assert not Path(f"/proc/{pid}").exists()


def test_when_the_fork_server_cannot_start_every_node_counts_as_ended(tmp_path: Path) -> None:
    processes = NodeProcesses([sys.executable, "-c", "import no_such_module"], tmp_path / "server.log", os.environ)
    standard_input = processes.start("left", tmp_path / "left.log")

    code = ended(processes, "left")
    standard_input.close()
    processes.close(1.0)

    assert code == 1
    assert "no_such_module" in (tmp_path / "server.log").read_text()
