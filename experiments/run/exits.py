"""Exit codes of the commands, and errors as text instead of tracebacks.

    0 done, every [expect] holds    1 an [expect] does not hold    2 bad input    3 a node failed
    4 a defect of marconet itself    129 its terminal was closed (SIGHUP)    130 interrupted with Ctrl-C
    143 terminated (SIGTERM), as by a time limit

The first of these signals ends the work. Further ones within a second are ignored, so that a second Ctrl-C does not
interrupt the closing of the records.
"""

from __future__ import annotations

import signal
import sys
import threading
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from enum import IntEnum
from pathlib import Path
from types import FrameType
from typing import Final

from netem.wire.errors import Interrupted, NodeFailure

IGNORE_FURTHER_S: Final = 1.0
VERBS: Final = {"SIGINT": "interrupted", "SIGTERM": "terminated", "SIGHUP": "ended, as its terminal was closed"}


class ExitCode(IntEnum):
    DONE = 0
    EXPECTATION_BROKEN = 1
    BAD_INPUT = 2
    NODE_FAILED = 3
    DEFECT = 4
    HUNG_UP = 129
    INTERRUPTED = 130
    TERMINATED = 143


class Ended(SystemExit):
    """Ends the command with `exit_code`.

    `lines` are the error lines printed, without that about the records; `folder` has the records, if there are any.
    """

    def __init__(self, exit_code: ExitCode, *lines: str, folder: Path | None = None) -> None:
        super().__init__(int(exit_code))
        self.exit_code = exit_code
        self.folder = folder
        self.lines = [line for text in lines for line in text.splitlines() if line]


@contextmanager
def errors_as_text(show_traceback: bool, kept: Path | None = None) -> Iterator[None]:
    """Print an error of the `with` block as text and raise `Ended` with its code; `kept` is the folder of the records.

    SIGTERM and SIGHUP end the work as Ctrl-C does, so that records are closed and no robot process is left.
    """
    with _ended_by_signals():
        try:
            yield
        except Ended:
            raise
        except KeyboardInterrupt as error:
            number = error.number if isinstance(error, Interrupted) else int(signal.SIGINT)
            what = in_words(error)
            _print(what, _records_line(kept))
            raise Ended(ExitCode(128 + number), what, folder=_if_folder(kept)) from None
        except Exception as error:
            if show_traceback:
                traceback.print_exception(error)
            code = exit_code_of(error)
            said = getattr(error, "in_full", str(error)) if show_traceback else str(error)
            lines = [said or type(error).__name__]
            if code is ExitCode.DEFECT and not show_traceback:
                lines = [f"{type(error).__name__}: {error}", "this is a defect of marconet; --verbose shows where"]
            left = kept if getattr(error, "leaves_records", True) else None
            _print(*lines, _records_line(left))
            raise Ended(code, *lines, folder=_if_folder(left)) from None
        except BaseException as error:      # a library's panic, or sys.exit in a user's code
            if show_traceback:
                traceback.print_exception(error)
            what = f"{in_words(error)}: raised outside of a node's program"
            _print(what, _records_line(kept))
            raise Ended(ExitCode.NODE_FAILED, what, folder=_if_folder(kept)) from None


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """Raise Interrupted in the main thread for the signals that end a command, unless the parent ignores them."""
    if threading.current_thread() is not threading.main_thread():       # Python handles signals only there
        yield
        return
    raised_s = float("-inf")

    def end(number: int, frame: FrameType | None) -> None:
        nonlocal raised_s
        now_s = time.monotonic()
        if now_s > raised_s + IGNORE_FURTHER_S:
            raised_s = now_s
            raise Interrupted(number)

    ending = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = {number: signal.getsignal(number) for number in ending}
    taken = [number for number in ending if before[number] not in (signal.SIG_IGN, None)]      # as under nohup
    for number in taken:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number in taken:
            signal.signal(number, before[number])


def in_words(error: BaseException) -> str:
    """Return the cause that ended the work, as text for the summary."""
    if isinstance(error, KeyboardInterrupt):
        number = error.number if isinstance(error, Interrupted) else int(signal.SIGINT)
        name = signal.Signals(number).name
        return f"{VERBS.get(name, 'ended')} ({name})"
    return str(error) if isinstance(error, NodeFailure) else f"{type(error).__name__}: {error}"


def _if_folder(kept: Path | None) -> Path | None:
    return kept if kept is not None and kept.is_dir() else None


def _records_line(kept: Path | None) -> str:
    return f"what was recorded: {kept}" if _if_folder(kept) is not None else ""


def exit_code_of(error: Exception) -> ExitCode:
    """Return the exit code of an error: its attribute `exit_code`, BAD_INPUT for a plant or path, else DEFECT."""
    from fmus.errors import PlantError

    own = getattr(error, "exit_code", None)
    if own is not None:
        return ExitCode(own)
    return ExitCode.BAD_INPUT if isinstance(error, PlantError | OSError) else ExitCode.DEFECT


def _print(*lines: str) -> None:
    with suppress(OSError):             # the terminal may be closed
        for line in lines:
            if line:
                print(line, file=sys.stderr)
