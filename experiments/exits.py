"""How a command ends: exit codes, and errors as text instead of tracebacks.

    0 done, every [expect] holds    1 an [expect] does not hold    2 bad input    3 a node failed
    4 a defect of marconet itself    130 interrupted with Ctrl-C
"""

from __future__ import annotations

import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum


class ExitCode(IntEnum):
    DONE = 0
    EXPECTATION_BROKEN = 1
    BAD_INPUT = 2
    NODE_FAILED = 3
    DEFECT = 4
    INTERRUPTED = 130


@contextmanager
def errors_as_text(show_traceback: bool, kept: str = "") -> Iterator[None]:
    """Print what went wrong and exit with its code; `kept` says what is left of the work."""
    try:
        yield
    except KeyboardInterrupt:
        _tell("interrupted", kept)
        sys.exit(ExitCode.INTERRUPTED)
    except Exception as error:
        if show_traceback:
            traceback.print_exception(error)
        code = exit_code_of(error)
        if code is ExitCode.DEFECT and not show_traceback:
            _tell(f"{type(error).__name__}: {error}", "this is a defect of marconet; --traceback shows where", kept)
        else:
            _tell(str(error) or type(error).__name__, kept)
        sys.exit(code)


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
