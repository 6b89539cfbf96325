"""Severity of events: the program, medium or gateway that raises an event states it."""

from __future__ import annotations

from enum import IntEnum


class Level(IntEnum):
    """Severity, with the numbers of Foxglove's Log message."""

    DEBUG = 1
    INFO = 2
    WARNING = 3             # an assumption of the run failed, or something unwanted happened
    ERROR = 4
    FATAL = 5
