"""Ends a process when its parent ends, as Linux can (prctl(2)); on other systems nothing happens."""

from __future__ import annotations

import sys
from typing import Final

DEATH_SIGNAL: Final = 1


def end_with_parent(number: int) -> None:
    """Have the system send this process the signal `number` when its parent ends."""
    prctl(DEATH_SIGNAL, number)


def prctl(option: int, value: int) -> None:
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(option, value, 0, 0, 0)
