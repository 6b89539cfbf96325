"""The fork server and the emulator's end of it, with real processes."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from netem.transport.node_processes import NodeProcesses
from tests.processes import alive

SERVER = """
import os, subprocess, sys, time
from netem.transport import fork_server
fork_server.END_WITHIN_S = 0.2

def run_child(under_way):
    word = sys.stdin.readline().strip()
    if word == "crash":
        os.abort()
    if word == "open files":
        memory = os.fstat(under_way.file)
        found = [int(fd) for fd in os.listdir("/proc/self/fd") if os.path.lexists(f"/proc/self/fd/{fd}")]
        print(sorted(fd for fd in found if os.fstat(fd).st_ino != memory.st_ino))
        return 0
    if word == "start something":
        print(subprocess.Popen(["sleep", "3600"]).pid, flush=True)
        return 0
    if word == "deaf":
        print(os.getpid(), os.getppid(), flush=True)
        time.sleep(3600)
    print("was told", word, os.getpgid(0) == os.getpid(), open("/proc/self/comm").read().strip())
    return int(word)

sys.exit(fork_server.serve(run_child))
"""


@pytest.fixture
def processes(tmp_path: Path) -> Iterator[NodeProcesses]:
    found = NodeProcesses([sys.executable, "-c", SERVER], tmp_path / "server.log", os.environ)
    yield found
    found.close(5.0)


def wait_for(condition: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < deadline_s
        time.sleep(0.005)


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


def test_closing_ends_a_node_that_does_not_end_by_itself_and_says_where_it_was(
        tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    processes = NodeProcesses([sys.executable, "-c", SERVER], tmp_path / "server.log", os.environ)
    with processes.start("left", tmp_path / "left.log"):
        while "left" not in processes.pids():
            time.sleep(0.005)
        pid = processes.pids()["left"]

        processes.close(0.2)

    assert not Path(f"/proc/{pid}").exists()
    assert len(caplog.messages) == 1
    assert re.fullmatch(r"node left: its process did not end within 0.2 s, and was killed: it hangs at <string>:\d+ in "
                        r"run_child", caplog.messages[0])


def test_when_the_fork_server_cannot_start_every_node_counts_as_ended(tmp_path: Path) -> None:
    processes = NodeProcesses([sys.executable, "-c", "import no_such_module"], tmp_path / "server.log", os.environ)
    standard_input = processes.start("left", tmp_path / "left.log")

    code = ended(processes, "left")
    standard_input.close()
    processes.close(1.0)

    assert code == 1
    assert "no_such_module" in (tmp_path / "server.log").read_text()


def test_a_node_has_no_open_file_of_another(processes: NodeProcesses, tmp_path: Path) -> None:
    """Else the pipe of one node would stay open in another, and closing it would not end the node."""
    with processes.start("first", tmp_path / "first.log") as first:
        first.write(b"deaf\n")
    wait_for(lambda: (tmp_path / "first.log").read_text() != "")
    with processes.start("second", tmp_path / "second.log") as second:
        second.write(b"open files\n")

    ended(processes, "second")

    assert (tmp_path / "second.log").read_text() == "[0, 1, 2]\n"
    processes.kill("first")


def test_what_a_node_has_started_ends_with_it(processes: NodeProcesses, tmp_path: Path) -> None:
    with processes.start("left", tmp_path / "left.log") as standard_input:
        standard_input.write(b"start something\n")

    code = ended(processes, "left")

    started = int((tmp_path / "left.log").read_text())
    assert code == 0
    wait_for(lambda: not alive(started))


def test_when_the_fork_server_is_killed_its_nodes_are_told_apart_from_one_that_ended_before(
        processes: NodeProcesses, tmp_path: Path) -> None:
    with processes.start("first", tmp_path / "first.log") as standard_input:
        standard_input.write(b"5\n")
    ended(processes, "first")
    with processes.start("second", tmp_path / "second.log") as standard_input:
        standard_input.write(b"deaf\n")
    wait_for(lambda: (tmp_path / "second.log").read_text() != "")
    node, server = map(int, (tmp_path / "second.log").read_text().split())

    os.kill(server, signal.SIGKILL)

    assert (ended(processes, "first"), processes.orphaned("first")) == (5, False)
    assert (ended(processes, "second"), processes.orphaned("second")) == (-signal.SIGKILL, True)
    os.kill(node, signal.SIGKILL)


def test_a_node_that_does_not_notice_that_the_emulator_has_gone_is_killed(tmp_path: Path) -> None:
    log = tmp_path / "deaf.log"
    emulator = subprocess.Popen([sys.executable, "-c", f"""
import os, sys, time
from pathlib import Path
from netem.transport.node_processes import NodeProcesses
processes = NodeProcesses([sys.executable, "-c", {SERVER!r}], Path({str(tmp_path / "server.log")!r}), os.environ)
with processes.start("deaf", Path({str(log)!r})) as standard_input:
    standard_input.write(b"deaf\\n")
time.sleep(3600)
"""])
    wait_for(lambda: log.exists() and log.read_text().endswith("\n"))
    node, server = map(int, log.read_text().split())

    emulator.kill()
    emulator.wait()

    wait_for(lambda: not alive(node) and not alive(server))


@pytest.mark.slow
def test_more_nodes_than_the_socket_holds_messages_are_all_started(tmp_path: Path) -> None:
    """The fork server takes its time: orders and news pile up in both directions."""
    slow = SERVER.replace("sys.exit(serve", "import time; time.sleep(0.5); sys.exit(serve")
    processes = NodeProcesses([sys.executable, "-c", slow], tmp_path / "server.log", os.environ)
    nodes = [f"n{k}" for k in range(400)]
    processes.exit_code("n0")               # as the watchdog does

    for node in nodes:
        with processes.start(node, tmp_path / "node.log") as standard_input:
            standard_input.write(b"0\n")
    codes = {ended(processes, node) for node in nodes}
    processes.close(5.0)

    assert codes == {0}
