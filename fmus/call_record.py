"""Where a plant notes which FMI call runs, so that another process can tell after a crash or while it hangs."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any, Protocol


class CallRecord(Protocol):
    @property
    def call_word(self) -> memoryview:
        """One 64-bit integer: the number of the call that runs, 0 between calls."""

    def place(self, call: str) -> int:
        """The number of a call by its name, as "fmi3DoStep of plant cart"."""


class NoRecord:
    """Takes the calls of a plant whose process is not watched, and keeps none."""

    def __init__(self) -> None:
        self.call_word = memoryview(bytearray(ctypes.sizeof(ctypes.c_int64))).cast("q")

    def place(self, call: str) -> int:
        return 0


def recorded(function: Callable[..., Any], record: CallRecord, call: str) -> Callable[..., Any]:
    """`function`, noted as `call` while it runs: for calls that are rare."""
    number = record.place(call)

    def noted(*arguments: Any) -> Any:
        record.call_word[0] = number
        try:
            return function(*arguments)
        finally:
            record.call_word[0] = 0

    return noted
