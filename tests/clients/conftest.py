"""A run in real time and its clients, each in its own process, connected by a UDP port of the loopback only."""

from __future__ import annotations

import os
import queue
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from experiments.judge.run_data import RunData, load_run
from experiments.scenario import find

PATIENCE_S = 60.0
END = ""                        # differs from every line, as these end in a newline


class Program:
    """A child process; a thread reads the lines of its output, and `type` writes to its standard input."""

    def __init__(self, command: list[str], folder: Path) -> None:
        self.process = subprocess.Popen(command, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        stderr=subprocess.STDOUT, text=True, bufsize=1,
                                        env={**os.environ, "PYTHONUNBUFFERED": "1"})
        self.lines: list[str] = []
        self._coming: queue.Queue[str] = queue.Queue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        for line in self.process.stdout:
            self._coming.put(line)
        self._coming.put(END)

    def until(self, pattern: str, patience_s: float = PATIENCE_S) -> str:
        """Return the first line from now on that matches; raises AssertionError after `patience_s`."""
        end_s = time.monotonic() + patience_s
        while True:
            try:
                line = self._coming.get(timeout=max(0.0, end_s - time.monotonic()))
            except queue.Empty:
                raise AssertionError(f"no {pattern!r} within {patience_s} s:\n{''.join(self.lines)}") from None
            if line == END:
                raise AssertionError(f"it ended before {pattern!r}:\n{''.join(self.lines)}")
            self.lines.append(line)
            if re.search(pattern, line):
                return line

    def type(self, text: str) -> None:
        self.process.stdin.write(text + "\n")
        self.process.stdin.flush()

    def type_until(self, text: str, pattern: str) -> str:
        """Type `text` every second until a line matches, as the program takes time for earlier input."""
        for _ in range(int(PATIENCE_S)):
            self.type(text)
            with suppress(AssertionError):
                return self.until(pattern, 1.0)
        raise AssertionError(f"{text!r} was never answered with {pattern!r}:\n{''.join(self.lines)}")

    def end(self, interrupt: bool = True) -> int:
        """Wait for the end of the process, after an interrupt (SIGINT) if it still runs; returns its exit code."""
        if interrupt and self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            code = self.process.wait(timeout=PATIENCE_S)
        finally:
            self.process.kill()
        self._reader.join(timeout=5.0)
        with suppress(BrokenPipeError):
            self.process.stdin.close()
        self.process.stdout.close()
        return code


def until_begun(run: Program, folder: Path) -> None:
    """Wait until a run in real time with this folder has begun."""
    end_s = time.monotonic() + PATIENCE_S
    while not (folder / "run.faults").exists():
        assert run.process.poll() is None, "".join(run.lines)
        assert time.monotonic() < end_s
        time.sleep(0.05)


class FlyingRun:
    """`quadrotor_udp` in real time. It sends its first datagram to `client_port`, on which a client has to listen."""

    def __init__(self, folder: Path) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind(("127.0.0.1", 0))
            self.client_port = free.getsockname()[1]
        self.folder = folder
        self.program = Program(
            [str(Path(sys.executable).with_name("marconet")), "run", str(find("quadrotor_udp")), "--real-time", "--out",
             str(folder), "--set", "gateways.ground.listen='127.0.0.1:0'",
             "--set", f"gateways.ground.peer='127.0.0.1:{self.client_port}'"], Path.cwd())

    def data(self) -> RunData:
        """End the run and read its records."""
        assert self.program.process.poll() is None, "".join(self.program.lines)
        self.program.end()
        return load_run(self.folder)


@pytest.fixture
def flying(tmp_path: Path) -> Iterator[FlyingRun]:
    run = FlyingRun(tmp_path / "run")
    yield run
    run.program.end()


@pytest.fixture
def start() -> Iterator[Callable[[list[str], Path], Program]]:
    started = []

    def begin(command: list[str], folder: Path) -> Program:
        started.append(Program(command, folder))
        return started[-1]

    yield begin
    for program in started:
        program.end()
