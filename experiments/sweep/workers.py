"""Worker processes of this machine: points go out in batches, the figures of each run come back as it ends.

    with Workers(source, host, jobs) as workers:
        workers.check(settings)
        for point, figures in workers.evaluate(points): ...

*Invariants*
- Each point is yielded once, in the order in which runs end. A worker has one batch at a time, of points that differ in
  the seed only.
- A run during which its worker ended is repeated once, alone; if that worker ends as well, the run counts as failed.
- No worker outlives the `with` block, nor this process: a worker ends when the other end of its socket closes, on Linux
  also in the middle of a run (prctl(2), PR_SET_PDEATHSIG).
"""

from __future__ import annotations

import fcntl
import os
import signal
import socket
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from tempfile import TemporaryFile
from types import TracebackType
from typing import IO, Any, Final

from experiments.judge.figures import Figures
from experiments.scenario.problems import ScenarioError
from experiments.sweep.messages import (
    Batch,
    Begin,
    Check,
    Checked,
    Done,
    FromWorker,
    Host,
    Point,
    Ready,
    Refused,
    Source,
    ToWorker,
    decode_from_worker,
    encode,
)

BATCH_S: Final = 0.5                    # wall time that a batch should take
MOST_IN_BATCH: Final = 64
SETTINGS_AT_ONCE: Final = 16            # settings that a worker checks before it answers
TOLD_BYTES: Final = 4000                # read of what a worker that ended had printed


class WorkersEnd(Exception):
    """A worker process cannot start."""

    exit_code = 4


class _Process:
    """One worker. `points` are those of its batch that have not ended."""

    def __init__(self, source: Source, host: Host) -> None:
        ours, theirs = socket.socketpair()
        self._errors: IO[bytes] = TemporaryFile()       # noqa: SIM115  # closed by `end`
        fcntl.fcntl(self._errors, fcntl.F_SETFL, os.O_APPEND)
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "experiments.sweep.worker", str(theirs.fileno())],
                pass_fds=[theirs.fileno()], stdin=subprocess.DEVNULL, stderr=self._errors, start_new_session=True)
        self.connection = Connection(ours.detach())
        self.points: deque[Point] = deque()
        self.checks = 0
        self.ready = False
        self.began_s = time.monotonic()
        self.pid = self._process.pid
        self.send(Begin(source, host))

    @property
    def idle(self) -> bool:
        return not self.points and not self.checks

    def send(self, message: ToWorker) -> None:
        with suppress(ConnectionError):                     # it has ended: `receive` says so
            self.connection.send_bytes(encode(message))

    def receive(self) -> FromWorker | None:
        """Return the next message, None if the worker has ended."""
        try:
            message: FromWorker = decode_from_worker(self.connection.recv_bytes())
            return message
        except (EOFError, ConnectionError):
            return None

    def forget_errors(self) -> None:
        self._errors.truncate(0)

    def end(self) -> str:
        """End the worker and all that it started; return how it ended, in words."""
        with suppress(ProcessLookupError, PermissionError):
            if self._process.poll() is None:
                os.killpg(self.pid, signal.SIGKILL)
        status = self._process.wait()
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.pid, signal.SIGKILL)             # robots' processes that it left
        self.connection.close()
        with self._errors as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(0, size - TOLD_BYTES))
            told = file.read().decode(errors="replace").splitlines()
        about = next((line for line in told if line.startswith("node ")), "")
        self.told = "\n".join(told)
        if about:
            return about
        return f"its process was killed by {signal.Signals(-status).name}" if status < 0 else \
            f"its process ended with exit code {status}"


class Workers:
    """`jobs` processes that run the scenario of `source` on `host`; see the module for what holds."""

    def __init__(self, source: Source, host: Host, jobs: int) -> None:
        if jobs < 1:
            raise ValueError(f"jobs={jobs}: expected at least 1")
        self._source = source
        self._host: Host = host
        self._jobs = jobs
        self._processes: list[_Process] = []
        self._run_s = 0.0                                   # wall time of a run so far, 0: unknown

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    @property
    def pids(self) -> list[int]:
        return [process.pid for process in self._processes]

    @property
    def size(self) -> int:
        """The number of runs at a time."""
        return self._jobs

    def close(self) -> None:
        """End all workers, whatever they do."""
        while self._processes:
            self._processes.pop().end()

    def check(self, settings: Sequence[dict[str, Any]]) -> list[str]:
        """Load the scenario with each setting; return the problems found, one line each."""
        waiting = deque(list(settings[start:start + SETTINGS_AT_ONCE])
                        for start in range(0, len(settings), SETTINGS_AT_ONCE))
        problems: dict[str, None] = {}
        while waiting or any(process.checks for process in self._processes):
            self._start(min(self._jobs, len(waiting)))
            for process in self._processes:
                if waiting and process.idle:
                    process.checks = 1
                    process.send(Check(waiting.popleft()))
            for process in self._answering():
                message = process.receive()
                if isinstance(message, Checked):
                    process.checks = 0
                    problems |= dict.fromkeys(message.problems)
                elif message is None:
                    how = self._lose(process)
                    raise ScenarioError([f"{self._source.path}: a check of its settings failed: {how}"])
                else:
                    self._note(process, message)
        return list(problems)

    def evaluate(self, points: Iterable[Point]) -> Iterator[tuple[Point, Figures]]:
        """Run the points and yield the figures of each.

        Raises ScenarioError for a point that cannot be run at all. If the caller stops iterating, what is under way
        ends; a further call begins anew.
        """
        waiting = deque(points)
        suspects: set[int] = set()                          # numbers of points during which a worker ended
        try:
            while waiting or any(process.points for process in self._processes):
                self._start(min(self._jobs, len(waiting) + len(self._processes)))
                for process in self._processes:
                    if waiting and process.idle:
                        self._give(process, waiting)
                for process in self._answering():
                    message = process.receive()
                    if isinstance(message, Done):
                        point = process.points.popleft()
                        assert point.number == message.number
                        self._timed(process)
                        yield point, message.figures
                    elif message is not None:
                        self._note(process, message)
                    elif process.points:
                        point, *rest = process.points
                        how = self._lose(process)
                        waiting.extendleft(reversed(rest))
                        if point.number in suspects:
                            yield point, Figures(point.seed, "", False, {}, failure=how)
                        else:
                            suspects.add(point.number)
                            waiting.append(point)
                    else:
                        self._lose(process)
        finally:
            if any(process.points for process in self._processes):
                self.close()

    def _give(self, process: _Process, waiting: deque[Point]) -> None:
        """Send as many points of one setting as take BATCH_S, fewer towards the end so that all workers end at once."""
        fair = -(-len(waiting) // (2 * self._jobs))
        most = min(MOST_IN_BATCH, fair, max(1, int(BATCH_S / self._run_s)) if self._run_s else 1)
        process.points.append(waiting.popleft())
        while waiting and len(process.points) < most and waiting[0].values == process.points[0].values:
            process.points.append(waiting.popleft())
        process.began_s = time.monotonic()
        process.forget_errors()
        process.send(Batch(list(process.points)))

    def _timed(self, process: _Process) -> None:
        now_s = time.monotonic()
        took_s = now_s - process.began_s
        process.began_s = now_s
        self._run_s = took_s if not self._run_s else 0.8 * self._run_s + 0.2 * took_s

    def _answering(self) -> list[_Process]:
        ready = wait([process.connection for process in self._processes], timeout=1.0)
        return [process for process in self._processes if process.connection in ready]

    def _start(self, wanted: int) -> None:
        while len(self._processes) < wanted:
            self._processes.append(_Process(self._source, self._host))

    def _note(self, process: _Process, message: FromWorker) -> None:
        if isinstance(message, Ready):
            process.ready = True
        elif isinstance(message, Refused):
            raise ScenarioError(message.lines)

    def _lose(self, process: _Process) -> str:
        """Take a worker that has ended off the list; return how it ended. WorkersEnd if it never became ready."""
        self._processes.remove(process)
        how = process.end()
        if not process.ready:
            raise WorkersEnd(f"a worker of the campaign cannot start: {how}\n{process.told}".rstrip())
        return how
