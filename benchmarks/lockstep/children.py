"""Starts child processes, waits for them with a time limit, and ends them by their handles in any case."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

GRACE_S = 5.0


class Stuck(Exception):
    """A process did not end in time, or ended with an error."""


@contextmanager
def children(commands: Sequence[Sequence[str]]) -> Iterator[list[subprocess.Popen[bytes]]]:
    """Start `python -m <command>` for each command; all have ended when the `with` block has."""
    started: list[subprocess.Popen[bytes]] = []
    try:
        for command in commands:
            started.append(subprocess.Popen([sys.executable, "-m", *command], stdin=subprocess.DEVNULL))
        yield started
    finally:
        for child in started:
            if child.poll() is None:
                child.send_signal(signal.SIGTERM)
        for child in started:
            try:
                child.wait(GRACE_S)
            except subprocess.TimeoutExpired:
                child.kill()
                child.wait()


def leave_on_sigterm() -> None:
    """Make SIGTERM raise an exception, as Ctrl-C does, so that every `with` block is left."""
    def leave(number: int, _: object) -> None:
        sys.exit(128 + number)
    signal.signal(signal.SIGTERM, leave)


def wait_for_all(started: Sequence[subprocess.Popen[bytes]], limit_s: float, is_done: Callable[[int], bool]) -> None:
    """Wait until every process has ended.

    Raises `Stuck` for one that has not ended within `limit_s`, or that failed before its work was done. A process that
    fails in its clean-up afterwards has done its work.
    """
    deadline_s = time.monotonic() + limit_s
    for index, child in enumerate(started):
        try:
            code = child.wait(max(0.0, deadline_s - time.monotonic()))
        except subprocess.TimeoutExpired:
            raise Stuck(f"process {index} (pid {child.pid}) had not ended after {limit_s:.0f} s") from None
        if code and not is_done(index):
            raise Stuck(f"process {index} (pid {child.pid}) ended with code {code}")
