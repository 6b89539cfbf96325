"""Starts the fork servers of runs within tests by forking one process, which has imported what a fork server imports.

These imports take a quarter of a second of processor time in each of some 300 runs with processes. A fork server that
was forked is what it is otherwise: a process with its own arguments, environment, folder, log and process group. One
whose variables of Python or marconet differ is started anew, and so is that of a run in a process of its own (the
command `marconet`).

    test process --(arguments, environment; standard input, log, status)--> warm process --fork--> fork server
                 <---------------- process id, later the exit code, by the status socket -----
"""

from __future__ import annotations

import json
import os
import runpy
import selectors
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from types import SimpleNamespace
from typing import Any, Final

import experiments  # before all others of ours: it finds the compiled modules
from netem.transport import node_processes
from netem.transport.process_host import ENVIRONMENT

MODULE: Final = "experiments.run.node_process"
START: Final = [sys.executable, "-P", "-m", MODULE]
LONGEST_MESSAGE: Final = 150_000
ANSWER_WITHIN_S: Final = 60.0
READ_AT_START: Final = ("PYTHON", "MARCONET")       # variables that a process may have read already


class Forked:
    """A process that the warm process has forked, with the methods of `subprocess.Popen` that a host uses."""

    def __init__(self, status: socket.socket) -> None:
        status.settimeout(ANSWER_WITHIN_S)
        self.pid = int(status.recv(32))
        self.returncode: int | None = None
        self._status = status

    def poll(self) -> int | None:
        return self._read(0.0)

    def wait(self, timeout: float | None = None) -> int:
        code = self._read(timeout)
        if code is None:
            raise subprocess.TimeoutExpired(MODULE, timeout or 0.0)
        return code

    def kill(self) -> None:
        with suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGKILL)

    def _read(self, timeout_s: float | None) -> int | None:
        if self.returncode is None:
            self._status.settimeout(timeout_s)
            with suppress(BlockingIOError, TimeoutError):
                self.returncode = int(self._status.recv(32) or -signal.SIGKILL)
                self._status.close()
        return self.returncode


@contextmanager
def warm_fork_server() -> Iterator[None]:
    """Let runs of this process have their fork servers forked; the warm process starts with the first of them."""
    environment = os.environ | ENVIRONMENT
    started: list[tuple[subprocess.Popen[bytes], socket.socket]] = []

    def control() -> socket.socket:
        if not started:
            ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            with theirs:
                started.append((subprocess.Popen([sys.executable, "-P", __file__], stdin=theirs.fileno(),
                                                 env=environment), ours))
        return started[0][1]

    def start(command: Sequence[str], **how: Any) -> Any:
        env: Mapping[str, str] = how["env"]
        if [*command[:4]] != START or _of_the_start(env) != _of_the_start(environment):
            return subprocess.Popen(command, **how)
        status, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            order = json.dumps([command[4:], dict(env), os.getcwd()]).encode()
            socket.send_fds(control(), [order], [how["stdin"], how["stdout"].fileno(), theirs.fileno()])
        return Forked(status)

    theirs = node_processes.subprocess
    node_processes.subprocess = SimpleNamespace(         # type: ignore[assignment]
        Popen=start, STDOUT=subprocess.STDOUT, TimeoutExpired=subprocess.TimeoutExpired)
    try:
        yield
    finally:
        node_processes.subprocess = theirs
        for process, ours in started:
            ours.close()
            process.wait(ANSWER_WITHIN_S)


def _of_the_start(environment: Mapping[str, str]) -> dict[str, str]:
    return {name: value for name, value in environment.items() if name.startswith(READ_AT_START)}


def serve() -> None:
    """Fork a fork server for each order on the standard input, and send its exit code."""
    control = socket.socket(fileno=os.dup(0))
    selector = selectors.DefaultSelector()
    selector.register(control, selectors.EVENT_READ)
    forked: dict[int, tuple[int, socket.socket]] = {}           # by pidfd: (pid, status)
    while True:
        for key, _ in selector.select():
            if key.fd in forked:
                selector.unregister(key.fd)
                pid, status = forked.pop(key.fd)
                os.close(key.fd)
                with status, suppress(OSError):
                    status.send(b"%d" % os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
                continue
            message, fds, _, _ = socket.recv_fds(control, LONGEST_MESSAGE, 3)
            if not message:
                return None
            pid = os.fork()
            if pid == 0:
                selector.close()
                control.close()
                for pidfd, (_, status) in forked.items():
                    os.close(pidfd)
                    status.close()
                return _become(json.loads(message), *fds)
            os.close(fds[0])
            os.close(fds[1])
            pidfd = os.pidfd_open(pid)
            forked[pidfd] = pid, socket.socket(fileno=fds[2])
            selector.register(pidfd, selectors.EVENT_READ)


def _become(order: tuple[list[str], dict[str, str], str], standard_input: int, log: int, status: int) -> None:
    """Turn this process into a fork server; the process that asked for it goes on when all is set."""
    arguments, environment, folder = order
    os.setpgid(0, 0)
    os.chdir(folder)
    for target, fd in ((0, standard_input), (1, log), (2, log)):
        os.dup2(fd, target)
    with socket.socket(fileno=status) as told:
        told.send(b"%d" % os.getpid())
    for fd in (standard_input, log):
        os.close(fd)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv[1:] = arguments
    runpy.run_module(MODULE, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    import experiments.run.node_process  # noqa: F401  (once, for all fork servers)

    serve()
