"""Inline runs on the command line: the emulator and all robot programs in a child, and a small parent that outlives it.

    parent --fork--> child: scenario, emulator, robot programs, records
    parent <--pipe-- the folder, the names of the nodes, at last the exit code

What a robot program does to its process (a crash in a plant, `os._exit`) then ends the child alone. A child that
ends without a word ends as a failed program: the parent names the node whose code ran, says what happened and where,
and makes the records from the journals. It forwards the signals that end a command, and leaves no process behind.

The parent forks before anything heavy is imported. The child ends when its parent does (Linux).
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Final

import msgspec

from experiments.exits import ExitCode
from netem.diagnosis.stack_dump import dump_stacks_into
from netem.diagnosis.under_way import UnderWay

FORWARDED: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
DEATH_SIGNAL: Final = 1                 # prctl(2)
CHILD_SUBREAPER: Final = 36
LOOK_EVERY_S: Final = 0.05


class Told(msgspec.Struct):
    """Messages of the child to its parent, one line of JSON each."""

    folder: str = ""
    nodes: list[str] = []
    timeout_s: float = 30.0
    exit_code: int | None = None


@dataclass
class Child:
    """The child's end. `under_way` is memory that the parent reads if the child ends without a word."""

    under_way: UnderWay
    _pipe: int
    _told: Told = field(default_factory=Told)

    def begins(self, folder: Path, nodes: Sequence[str], timeout_s: float) -> None:
        """Say which run begins, before anything of a robot program runs."""
        self._told.folder, self._told.nodes, self._told.timeout_s = str(folder), list(nodes), timeout_s
        self._tell()

    def ends(self, exit_code: int) -> None:
        self._told.exit_code = exit_code
        self._tell()

    def _tell(self) -> None:
        with suppress(OSError):                 # a robot program has closed it: the parent judges by how it ends
            os.write(self._pipe, msgspec.json.encode(self._told) + b"\n")


def run_in_child(work: Callable[[Child], int]) -> int:
    """Call `work` in a child; returns its exit code, or that of a failed program if the child ended without one."""
    under_way = UnderWay()
    reading, writing = os.pipe()
    sys.stdout.flush()
    sys.stderr.flush()
    parent = os.getpid()
    pid = os.fork()
    if pid == 0:
        os.close(reading)
        _be_child(Child(under_way, writing), work, parent)
    os.close(writing)
    _prctl(CHILD_SUBREAPER, 1)                  # what a robot program leaves behind becomes a child of this process
    before = {number: signal.signal(number, _forward_to(pid)) for number in FORWARDED
              if signal.getsignal(number) is not signal.SIG_IGN}
    try:
        told = Told()
        status, stopped = _await(pid, lambda: _listen(reading, told).timeout_s)
        _listen(reading, told)
    finally:
        os.close(reading)
        _end_children()
        for number, handler in before.items():
            signal.signal(number, handler)
    if told.exit_code is not None and not stopped:
        return told.exit_code
    return _conclude(told, status, stopped, under_way)


def _be_child(child: Child, work: Callable[[Child], int], parent: int) -> None:
    """Never returns: what the parent had planned for its own end is not the child's."""
    code: int = ExitCode.DEFECT
    try:
        _prctl(DEATH_SIGNAL, signal.SIGTERM)
        if os.getppid() != parent:
            os._exit(code)
        dump_stacks_into(child.under_way)
        code = work(child)
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(bool(end.code))
    except BaseException:
        sys.excepthook(*sys.exc_info())
    finally:
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError, AttributeError):
                stream.flush()
        child.ends(code)
        os._exit(code)


def _forward_to(pid: int) -> Callable[[int, FrameType | None], None]:
    def forward(number: int, frame: FrameType | None) -> None:
        with suppress(ProcessLookupError):
            os.kill(pid, number)

    return forward


def _await(pid: int, patience_s: Callable[[], float]) -> tuple[int, bool]:
    """Exit status of the child, and whether the parent ended it because it was stopped and not continued."""
    stopped_s = float("inf")
    while True:
        waiting = stopped_s < float("inf")
        found, status = os.waitpid(pid, os.WUNTRACED | os.WCONTINUED | (os.WNOHANG if waiting else 0))
        if found == 0:
            if time.monotonic() > stopped_s:
                os.kill(pid, signal.SIGKILL)
                return os.waitpid(pid, 0)[1], True
            time.sleep(LOOK_EVERY_S)
        elif os.WIFSTOPPED(status):
            if os.WSTOPSIG(status) == signal.SIGSTOP:       # not Ctrl-Z, which stops this process as well
                stopped_s = time.monotonic() + patience_s()
        elif os.WIFCONTINUED(status):
            stopped_s = float("inf")
        else:
            return status, False


def _listen(reading: int, told: Told) -> Told:
    """Take in what the child has said. A pipe that other processes still hold open is not waited for."""
    os.set_blocking(reading, False)
    data = b""
    with suppress(BlockingIOError):
        while piece := os.read(reading, 1 << 16):
            data += piece
    for line in data.splitlines():
        with suppress(msgspec.MsgspecError):
            last = msgspec.json.decode(line, type=Told)
            told.folder, told.nodes, told.timeout_s, told.exit_code = (last.folder, last.nodes, last.timeout_s,
                                                                       last.exit_code)
    return told


def _end_children() -> None:
    """Kill what the child's programs left behind, and theirs."""
    with suppress(OSError):
        while children := Path(f"/proc/self/task/{os.getpid()}/children").read_text().split():
            for child in children:
                with suppress(ProcessLookupError):
                    os.kill(int(child), signal.SIGKILL)
                with suppress(ChildProcessError):
                    os.waitpid(int(child), 0)


def _conclude(told: Told, status: int, stopped: bool, under_way: UnderWay) -> int:
    """Say how the child ended, and make the records of its run."""
    from netem.diagnosis import words  # late: only where something went wrong
    from netem.lockstep.watchdog import last_words

    number = os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0
    if number in FORWARDED:
        print(f"ended by {signal.Signals(number).name} before the run could begin", file=sys.stderr)
        return 128 + number
    node, how, stack = last_words(os.waitstatus_to_exitcode(status), told.nodes, under_way, told.timeout_s)
    if stopped:
        how = words.hangs("no answer", told.timeout_s, under_way, stopped=True)
    what = f"node {node}: {how}" if node else f"the emulator: {how}"
    print(what, *([stack.rstrip()] if stack else []), sep="\n", file=sys.stderr)
    folder = Path(told.folder)
    if told.folder and (folder / "scenario.json").exists() and not (folder / "summary.json").exists():
        _make_records(folder, f"{what}\n{stack}".rstrip())
    return ExitCode.NODE_FAILED


def _make_records(folder: Path, failure: str) -> None:
    from experiments.killed_run import complete  # late: only where something went wrong
    from experiments.report.build import write_report

    for problem in complete(folder, failure, host="inline"):
        print(problem, file=sys.stderr)
    with suppress(OSError):
        write_report(folder)
    print(f"what was recorded: {folder}", file=sys.stderr)


def _prctl(option: int, value: int) -> None:
    """Linux's prctl(2); elsewhere nothing."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(option, value, 0, 0, 0)
