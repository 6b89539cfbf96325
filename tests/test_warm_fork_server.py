"""A fork server that was forked is what one that was started is, and is started where it has to be."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
from pathlib import Path
from typing import Any

import pytest

from experiments.run.runner import run
from experiments.scenario import find, load
from netem.transport import node_processes
from netem.transport.process_host import ENVIRONMENT
from tests.processes import alive
from tests.warm_fork_server import START, Forked

DURATION_S = 0.05


def started(folder: Path, environment: dict[str, str]) -> tuple[Any, socket.socket]:
    """A fork server, and the emulator's end of its socket; it ends when that is closed."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with theirs, (folder / "log").open("wb") as log:
        return node_processes.subprocess.Popen(START, stdin=theirs.fileno(), stdout=log, stderr=subprocess.STDOUT,
                                               process_group=0, env=environment), ours


def test_a_run_leaves_the_ledger_of_one_whose_fork_server_was_started(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = load(find("output_sync"), duration_s=DURATION_S)
    forked = run(scenario, host="process", out=tmp_path / "forked", report=False).summary

    monkeypatch.setattr(node_processes, "subprocess", subprocess)
    whole = run(scenario, host="process", out=tmp_path / "started", report=False).summary

    assert forked.ledger_hash == whole.ledger_hash


def test_it_has_the_group_the_folder_and_the_variables_that_one_would_have(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    server, ours = started(tmp_path, os.environ | ENVIRONMENT | {"OF_THIS_TEST": "1"})

    with ours:
        assert isinstance(server, Forked)
        assert server.poll() is None
        assert os.getpgid(server.pid) == server.pid
        assert Path(f"/proc/{server.pid}/cwd").readlink() == tmp_path

    assert server.wait(60) == 0
    assert not alive(server.pid)


def test_its_end_by_a_signal_is_told(tmp_path: Path) -> None:
    server, ours = started(tmp_path, os.environ | ENVIRONMENT)

    with ours:
        server.kill()

        assert server.wait(60) == server.poll() == -signal.SIGKILL


def test_with_other_variables_of_python_it_is_started(tmp_path: Path) -> None:
    server, ours = started(tmp_path, os.environ | ENVIRONMENT | {"PYTHONHASHSEED": "1"})

    with ours:
        assert isinstance(server, subprocess.Popen)

    assert server.wait(60) == 0
