"""Inline runs on the command line: the emulator and all robot programs in a child, and a small parent that outlives it.

    parent --fork--> child: scenarios, emulator, robot programs, records
    parent <-memory- the run that begins, what became of each scenario, at last the exit code

What a robot program does to its process (a crash in a plant, `os._exit`) then ends the child alone. A child that
ends without a word ends as a failed program: the parent names the node whose code ran, says what happened and where,
and makes the records from the journals. What the child had not begun goes on in a new child. The parent forwards the
signals that end a command, and leaves no process behind.

The parent forks before anything heavy is imported. The child ends when its parent does (Linux).
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
from netem.transport.left_behind import end_children, end_with_parent, take_orphans

FORWARDED: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
LOOK_EVERY_S: Final = 0.05
LENGTH: Final = struct.Struct("<I")     # before each word in the memory


class Begins(msgspec.Struct, tag=True):
    """A run begins: nothing of a robot program has run yet."""

    folder: str
    nodes: list[str]
    timeout_s: float


class Became(msgspec.Struct, tag=True):
    """Outcome of the next scenario, as the caller of `run_in_child` encodes it."""

    outcome: bytes


class Ends(msgspec.Struct, tag=True):
    exit_code: int


@dataclass(frozen=True)
class Ending:
    """How a child ended. `outcomes`: those it told; `broken_off`: it ended without a word, `lines` say how."""

    exit_code: int
    outcomes: list[bytes]
    broken_off: bool = False
    lines: list[str] = field(default_factory=list)
    folder: str = ""


class Child:
    """The child's end. `under_way` is memory that the parent reads if the child ends without a word."""

    def __init__(self, under_way: UnderWay, words: int) -> None:
        self.under_way = under_way
        self._words = words
        self._file = os.fstat(words).st_ino

    def begins(self, folder: Path, nodes: Sequence[str], timeout_s: float) -> None:
        """Say which run begins, before anything of a robot program runs."""
        self._tell(Begins(str(folder), list(nodes), timeout_s))

    def became(self, outcome: bytes) -> None:
        """Say what became of a scenario."""
        self._tell(Became(outcome))

    def ends(self, exit_code: int) -> None:
        self._tell(Ends(exit_code))

    def _tell(self, word: Begins | Became | Ends) -> None:
        data = msgspec.msgpack.encode(word)
        with suppress(OSError):                 # a robot program has closed it: the parent judges by how it ends
            if os.fstat(self._words).st_ino == self._file:
                os.write(self._words, LENGTH.pack(len(data)) + data)


def run_in_child(work: Callable[[Child], int]) -> Ending:
    """Call `work` in a child; its ending is that of a failed program if the child ended without a word."""
    under_way = UnderWay()
    words = os.memfd_create("what the child says", os.MFD_CLOEXEC)
    sys.stdout.flush()
    sys.stderr.flush()
    parent = os.getpid()
    pid = os.fork()
    if pid == 0:
        _be_child(Child(under_way, words), work, parent)
    take_orphans()
    try:
        with _forwarding_to(pid):
            try:
                status, stopped_in = _await(pid, under_way, lambda: _run_of(words).timeout_s)
            finally:
                end_children()
            outcomes = [word.outcome for word in _heard(words) if isinstance(word, Became)]
            code = next((word.exit_code for word in _heard(words) if isinstance(word, Ends)), None)
            if code is not None and stopped_in is None:
                return Ending(code, outcomes)
            return _conclude(_run_of(words), outcomes, status, stopped_in, under_way)
    finally:
        os.close(words)
        under_way.close()


def _be_child(child: Child, work: Callable[[Child], int], parent: int) -> None:
    """Never returns: what the parent had planned for its own end is not the child's."""
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
    """The same file by another descriptor, which stays open where a robot program closes 0, 1 and 2."""
    if not isinstance(stream, io.TextIOWrapper):
        return stream
    return io.TextIOWrapper(open(os.dup(stream.fileno()), "wb"), stream.encoding, stream.errors,
                            line_buffering=stream.line_buffering, write_through=stream.write_through)


@contextmanager
def _forwarding_to(pid: int) -> Iterator[None]:
    """Hand the signals that end a command on to `pid`; one that came after its end is raised again afterwards."""
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


def _await(pid: int, under_way: UnderWay, patience_s: Callable[[], float]) -> tuple[int, int | None]:
    """Wait for the child; return its status. A child that has stopped and is not continued within the time-out is ended
    here; the place of the node whose code stopped it is then returned as well."""
    stopped_s = float("inf")
    while True:
        waiting = stopped_s < float("inf")
        found, status = os.waitpid(pid, os.WUNTRACED | os.WCONTINUED | (os.WNOHANG if waiting else 0))
        if found == 0:
            if time.monotonic() > stopped_s:
                place = under_way.running()
                ask_for_dump(pid)
                return _end_of(pid), place
            time.sleep(LOOK_EVERY_S)
        elif os.WIFSTOPPED(status):
            if os.WSTOPSIG(status) == signal.SIGSTOP:       # not Ctrl-Z, which stops this process as well
                stopped_s = time.monotonic() + patience_s()
        elif os.WIFCONTINUED(status):
            stopped_s = float("inf")
        else:
            return status, None


def _end_of(pid: int) -> int:
    """How a process ended that is ending; it is killed if that takes longer than a dump of its stacks may."""
    deadline_s = time.monotonic() + DUMP_WITHIN_S
    while time.monotonic() < deadline_s:
        found, status = os.waitpid(pid, os.WNOHANG)
        if found:
            return status
        time.sleep(LOOK_EVERY_S)
    os.kill(pid, signal.SIGKILL)
    return os.waitpid(pid, 0)[1]


def _heard(words: int) -> list[Begins | Became | Ends]:
    """Messages of the child so far. A robot program may have written there: text that is no message ends the list."""
    data = os.pread(words, os.fstat(words).st_size, 0)
    decode = msgspec.msgpack.Decoder(Begins | Became | Ends).decode
    heard: list[Begins | Became | Ends] = []
    start = 0
    with suppress(msgspec.MsgspecError, struct.error, UnicodeDecodeError):
        while start < len(data):
            start += LENGTH.size
            length, = LENGTH.unpack(data[start - LENGTH.size:start])
            heard.append(decode(data[start:start + length]))
            start += length
    return heard


def _run_of(words: int) -> Begins:
    """The run under way; one without a folder where none has begun since the last scenario's end."""
    run = Begins("", [], 30.0)
    for word in _heard(words):
        if isinstance(word, Begins):
            run = word
        elif isinstance(word, Became):
            run = Begins("", [], 30.0)
    return run


def _conclude(run: Begins, outcomes: list[bytes], status: int, stopped_in: int | None, under_way: UnderWay) -> Ending:
    """Say how the child ended, and make the records of its run."""
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
    if number == 0 and run.folder and (failure := _failure_of(folder)):      # it had no file left to say it
        what, stack = failure, ""
    print(what, *([stack.rstrip()] if stack else []), sep="\n", file=sys.stderr)
    if run.folder:
        _make_records(folder, f"{what}\n{stack}".rstrip())
    return Ending(ExitCode.NODE_FAILED, outcomes, True, [what, *stack.splitlines()], run.folder)


def _failure_of(folder: Path) -> str:
    """The failure that the summary in `folder` names, "" if there is none."""
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
