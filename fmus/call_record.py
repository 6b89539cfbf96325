"""The record in which a plant notes the FMI call that runs; another process reads it when the call crashes or hangs."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any, Protocol


class CallRecord(Protocol):
    @property
    def call_word(self) -> memoryview:
        """One 64-bit integer: the number of the call that runs, 0 between calls."""

    @property
    def hold_word(self) -> memoryview:
        """One 64-bit integer: 1 while time-outs stand still, as a debugger holds the code that runs."""

    def place(self, call: str) -> int:
        """Return the number under which the call named `call`, as "fmi3DoStep of plant cart", is noted."""


class NoRecord:
    """The record of a plant whose process is not watched: one private word, which no other process reads."""

    def __init__(self) -> None:
        self.call_word = memoryview(bytearray(ctypes.sizeof(ctypes.c_int64))).cast("q")
        self.hold_word = memoryview(bytearray(ctypes.sizeof(ctypes.c_int64))).cast("q")

    def place(self, call: str) -> int:
        return 0


def recorded(function: Callable[..., Any], record: CallRecord, call: str) -> Callable[..., Any]:
    """Return `function` wrapped so that it is noted as `call` while it runs; meant for rare calls."""
    number = record.place(call)

    def noted(*arguments: Any) -> Any:
        record.call_word[0] = number
        try:
            return function(*arguments)
        finally:
            record.call_word[0] = 0

    return noted
