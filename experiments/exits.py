"""How a command ends: exit codes, and errors as text instead of tracebacks.

    0 done, every [expect] holds    1 an [expect] does not hold    2 bad input    3 a node failed
    4 a defect of marconet itself    130 interrupted with Ctrl-C    143 terminated (SIGTERM), as by a time limit
"""

from __future__ import annotations

import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum
from pathlib import Path
from types import FrameType
from typing import NoReturn


class ExitCode(IntEnum):
    DONE = 0
    EXPECTATION_BROKEN = 1
    BAD_INPUT = 2
    NODE_FAILED = 3
    DEFECT = 4
    INTERRUPTED = 130
    TERMINATED = 143


class Ended(SystemExit):
    """The command ends with this code; `lines` are what was printed about it, without where the records are."""

    def __init__(self, exit_code: ExitCode, *lines: str) -> None:
        super().__init__(int(exit_code))
        self.exit_code = exit_code
        self.lines = [line for text in lines for line in text.splitlines() if line]


class Terminated(BaseException):
    """The process was asked to end (SIGTERM)."""


@contextmanager
def errors_as_text(show_traceback: bool, kept: Path | None = None) -> Iterator[None]:
    """Print what went wrong and exit with its code; `kept` is the folder with what is left of the work, if it is there.

    SIGTERM ends the work as Ctrl-C does, so that records are closed and no robot process is left.
    """
    in_main = threading.current_thread() is threading.main_thread()     # only there signals can be handled
    before = signal.signal(signal.SIGTERM, _terminate) if in_main else None
    try:
        yield
    except (KeyboardInterrupt, Terminated) as error:
        interrupted = isinstance(error, KeyboardInterrupt)
        what = "interrupted" if interrupted else "terminated"
        _tell(what, _what_is_left(kept))
        raise Ended(ExitCode.INTERRUPTED if interrupted else ExitCode.TERMINATED, what) from None
    except Exception as error:
        if show_traceback:
            traceback.print_exception(error)
        code = exit_code_of(error)
        said = getattr(error, "in_full", str(error)) if show_traceback else str(error)
        lines = [said or type(error).__name__]
        if code is ExitCode.DEFECT and not show_traceback:
            lines = [f"{type(error).__name__}: {error}", "this is a defect of marconet; --verbose shows where"]
        _tell(*lines, _what_is_left(kept))
        raise Ended(code, *lines) from None
    finally:
        if before is not None:
            signal.signal(signal.SIGTERM, before)


def _terminate(number: int, frame: FrameType | None) -> NoReturn:
    raise Terminated


def _what_is_left(kept: Path | None) -> str:
    return f"what was recorded: {kept}" if kept is not None and kept.is_dir() else ""


def exit_code_of(error: Exception) -> ExitCode:
    """An error may bring its own; a user's plant or path is input."""
    from fmus.errors import PlantError

    own = getattr(error, "exit_code", None)
    if own is not None:
        return ExitCode(own)
    return ExitCode.BAD_INPUT if isinstance(error, PlantError | OSError) else ExitCode.DEFECT


def _tell(*lines: str) -> None:
    for line in lines:
        if line:
            print(line, file=sys.stderr)
