"""Inline runs on the command line: a child process has the emulator and all robot programs, and its parent outlives it.

    parent --fork--> child: scenarios, emulator, robot programs, records
    parent <-memory- messages: the run that begins, the outcome of each scenario, the exit code

A robot program that ends its process (by a crash in a plant, by `os._exit`) then ends only the child. If the child ends
without its last message, the parent reports a failed program: it prints the node whose code ran, the cause and the
place, and makes the records from the journals. A new child runs the remaining scenarios. The parent forwards the
signals that end a command, and leaves no process running.

The parent forks before it imports large modules. The child ends when its parent does (Linux).
"""

from __future__ import annotations

import io
import os
import signal
import struct
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Final, TextIO

import msgspec

from experiments.run.exits import ExitCode
from netem.transport.diagnosis.stack_dump import DUMP_WITHIN_S, ask_for_dump, dump_stacks_into
from netem.transport.diagnosis.under_way import UnderWay
from netem.transport.left_behind import end_children, take_orphans
from netem.wire.parent import end_with_parent

FORWARDED: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
LOOK_EVERY_S: Final = 0.05
LENGTH: Final = struct.Struct("<I")     # precedes each message in the shared memory


class Begins(msgspec.Struct, tag=True):
    """A run begins; no code of a robot program has run yet."""

    folder: str
    nodes: list[str]
    timeout_s: float


class Became(msgspec.Struct, tag=True):
    """The outcome of the next scenario, as the caller of `run_in_child` encodes it."""

    outcome: bytes


class Ends(msgspec.Struct, tag=True):
    exit_code: int


@dataclass(frozen=True)
class Ending:
    """The end of a child. `outcomes` are those that it reported.

    `broken_off` is True if it ended without its last message; `lines` then describe the end.
    """

    exit_code: int
    outcomes: list[bytes]
    broken_off: bool = False
    lines: list[str] = field(default_factory=list)
    folder: str = ""


class Child:
    """The child's side. `under_way` is memory that the parent reads if the child ends without its last message."""

    def __init__(self, under_way: UnderWay, channel: int) -> None:
        self.under_way = under_way
        self._channel = channel
        self._file = os.fstat(channel).st_ino

    def begins(self, folder: Path, nodes: Sequence[str], timeout_s: float) -> None:
        """Report the run that begins, before any code of a robot program runs."""
        self._send(Begins(str(folder), list(nodes), timeout_s))

    def became(self, outcome: bytes) -> None:
        """Report the outcome of a scenario."""
        self._send(Became(outcome))

    def ends(self, exit_code: int) -> None:
        self._send(Ends(exit_code))

    def _send(self, message: Begins | Became | Ends) -> None:
        data = msgspec.msgpack.encode(message)
        with suppress(OSError):                 # closed by a robot program: the parent uses the exit status instead
            if os.fstat(self._channel).st_ino == self._file:
                os.write(self._channel, LENGTH.pack(len(data)) + data)


def run_in_child(work: Callable[[Child], int]) -> Ending:
    """Call `work` in a child and return how it ended: as a failed program if its last message is missing."""
    under_way = UnderWay()
    channel = os.memfd_create("messages of the child", os.MFD_CLOEXEC)
    sys.stdout.flush()
    sys.stderr.flush()
    parent = os.getpid()
    pid = os.fork()
    if pid == 0:
        _be_child(Child(under_way, channel), work, parent)
    take_orphans()
    try:
        with _forwarding_to(pid):
            try:
                status, stopped_in = _wait_for(pid, under_way, lambda: _run_in_progress(channel).timeout_s)
            finally:
                end_children()
            outcomes = [message.outcome for message in _messages_in(channel) if isinstance(message, Became)]
            code = next((message.exit_code for message in _messages_in(channel) if isinstance(message, Ends)), None)
            if code is not None and stopped_in is None:
                return Ending(code, outcomes)
            return _conclude(_run_in_progress(channel), outcomes, status, stopped_in, under_way)
    finally:
        os.close(channel)
        under_way.close()


def _be_child(child: Child, work: Callable[[Child], int], parent: int) -> None:
    """Run `work` and end the process; never return, as the code after the fork belongs to the parent."""
    code: int = ExitCode.DEFECT
    try:
        end_with_parent(signal.SIGTERM)
        if os.getppid() != parent:
            os._exit(code)
        sys.stdout, sys.stderr = _out_of_reach(sys.stdout), _out_of_reach(sys.stderr)
        dump_stacks_into(child.under_way, then_end=True)
        code = work(child)
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(bool(end.code))
    except KeyboardInterrupt:                   # between two runs
        code = ExitCode.INTERRUPTED
    except BaseException:
        sys.excepthook(*sys.exc_info())
    finally:
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError, AttributeError):
                stream.flush()
        child.ends(code)
        os._exit(code)


def _out_of_reach(stream: TextIO) -> TextIO:
    """Return a stream to the same file by another descriptor, in case a robot program closes 0, 1 and 2."""
    if not isinstance(stream, io.TextIOWrapper):
        return stream
    return io.TextIOWrapper(open(os.dup(stream.fileno()), "wb"), stream.encoding, stream.errors,
                            line_buffering=stream.line_buffering, write_through=stream.write_through)


@contextmanager
def _forwarding_to(pid: int) -> Iterator[None]:
    """Forward the signals that end a command to `pid`; raise the first that arrives after its end again afterwards."""
    late: list[int] = []

    def forward(number: int, frame: FrameType | None) -> None:
        try:
            os.kill(pid, number)
        except ProcessLookupError:
            late.append(number)

    before = {number: signal.signal(number, forward) for number in FORWARDED
              if signal.getsignal(number) is not signal.SIG_IGN}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if late:
        signal.raise_signal(late[0])


def _wait_for(pid: int, under_way: UnderWay, patience_s: Callable[[], float]) -> tuple[int, int | None]:
    """Wait for the child; return its status and None.

    A child that has stopped and does not continue within `patience_s()` is ended; then the second value is the place of
    the node whose code stopped it.
    """
    stopped_s = float("inf")
    while True:
        waiting = stopped_s < float("inf")
        found, status = os.waitpid(pid, os.WUNTRACED | os.WCONTINUED | (os.WNOHANG if waiting else 0))
        if found == 0:
            if time.monotonic() > stopped_s:
                place = under_way.running()
                ask_for_dump(pid)
                return _wait_or_kill(pid), place
            time.sleep(LOOK_EVERY_S)
        elif os.WIFSTOPPED(status):
            if os.WSTOPSIG(status) == signal.SIGSTOP:       # not Ctrl-Z, which stops this process as well
                stopped_s = time.monotonic() + patience_s()
        elif os.WIFCONTINUED(status):
            stopped_s = float("inf")
        else:
            return status, None


def _wait_or_kill(pid: int) -> int:
    """Wait for the end of a process that is ending and return its status; kill it after DUMP_WITHIN_S."""
    deadline_s = time.monotonic() + DUMP_WITHIN_S
    while time.monotonic() < deadline_s:
        found, status = os.waitpid(pid, os.WNOHANG)
        if found:
            return status
        time.sleep(LOOK_EVERY_S)
    os.kill(pid, signal.SIGKILL)
    return os.waitpid(pid, 0)[1]


def _messages_in(channel: int) -> list[Begins | Became | Ends]:
    """Return the messages of the child so far, up to bytes that are none, as a robot program may have written there."""
    data = os.pread(channel, os.fstat(channel).st_size, 0)
    decode = msgspec.msgpack.Decoder(Begins | Became | Ends).decode
    messages: list[Begins | Became | Ends] = []
    start = 0
    with suppress(msgspec.MsgspecError, struct.error, UnicodeDecodeError):
        while start < len(data):
            start += LENGTH.size
            length, = LENGTH.unpack(data[start - LENGTH.size:start])
            messages.append(decode(data[start:start + length]))
            start += length
    return messages


def _run_in_progress(channel: int) -> Begins:
    """Return the run in progress; without one, a `Begins` without a folder."""
    run = Begins("", [], 30.0)
    for message in _messages_in(channel):
        if isinstance(message, Begins):
            run = message
        elif isinstance(message, Became):
            run = Begins("", [], 30.0)
    return run


def _conclude(run: Begins, outcomes: list[bytes], status: int, stopped_in: int | None, under_way: UnderWay) -> Ending:
    """Print how the child ended, make the records of its run, and return its ending."""
    from netem.transport.diagnosis import words  # late: only where something went wrong
    from netem.transport.watchdog import last_words

    number = os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0
    if number in FORWARDED:
        what = f"ended by {signal.Signals(number).name} before the run could begin"
        print(what, file=sys.stderr)
        return Ending(128 + number, outcomes, True, [what])
    node, how, stack = last_words(os.waitstatus_to_exitcode(status), run.nodes, under_way, run.timeout_s)
    if stopped_in is not None:
        node = run.nodes[stopped_in - 1] if 0 < stopped_in <= len(run.nodes) else ""
        how = words.hangs("no answer", run.timeout_s, under_way, stopped=True)
    folder = Path(run.folder)
    what = f"node {node}: {how}" if node else f"the emulator: {how}"
    if number == 0 and run.folder and (failure := _failure_of(folder)):      # all files of the child were closed
        what, stack = failure, ""
    print(what, *([stack.rstrip()] if stack else []), sep="\n", file=sys.stderr)
    if run.folder:
        _make_records(folder, f"{what}\n{stack}".rstrip())
    return Ending(ExitCode.NODE_FAILED, outcomes, True, [what, *stack.splitlines()], run.folder)


def _failure_of(folder: Path) -> str:
    """Return the failure that the summary in `folder` names, "" if there is none."""
    from experiments.judge.run_files import SUMMARY

    with suppress(OSError, msgspec.MsgspecError):
        return str(SUMMARY.read(folder)["failure"])
    return ""


def _make_records(folder: Path, failure: str) -> None:
    from experiments.run.killed_run import complete, is_unfinished  # late: only where something went wrong
    from experiments.show.report.build import write_report

    if not is_unfinished(folder):
        return
    for problem in complete(folder, failure, host="inline"):
        print(problem, file=sys.stderr)
    with suppress(OSError):
        write_report(folder)
    print(f"what was recorded: {folder}", file=sys.stderr)
