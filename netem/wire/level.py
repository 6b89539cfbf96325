"""How severe an event is: said where it happens, by a program, a medium or a gateway."""

from __future__ import annotations

from enum import IntEnum


class Level(IntEnum):
    """Severity, with the numbers of Foxglove's Log message."""

    DEBUG = 1
    INFO = 2
    WARNING = 3             # something that a run takes for granted, or that nobody wants, broke
    ERROR = 4
    FATAL = 5
