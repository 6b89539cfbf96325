"""What the emulator tells a node's process when it starts it: one line of JSON on the standard input.

The pipe stays open for as long as the emulator lives; when it closes, the node's process ends at once.
"""

from __future__ import annotations

import os
import sys
import threading

import msgspec

ABANDONED = 4       # exit code of a node whose emulator is gone


class StartMessage(msgspec.Struct):
    """`specification` is for the function that builds the node; in virtual time its program is guarded
    (`OutsideGuard`). `secret` lets the node into the emulator's session."""

    endpoint: str
    secret: str
    run: str
    node: str
    timeout_s: float
    specification: bytes
    virtual_time: bool = True


class EmulatorPipe:
    """What was the standard input of a node's process; a program that reads that finds its end, and so does what it
    starts. Unbuffered: a thread that waits in a buffered read would hold up the interpreter's exit for a second."""

    def __init__(self) -> None:
        standard_input = sys.stdin.fileno()
        self._pipe = os.dup(standard_input)
        with open(os.devnull, "rb") as nothing:
            os.dup2(nothing.fileno(), standard_input)
        self._done = threading.Event()
        self._closed = threading.Event()

    def read_start_message(self) -> StartMessage:
        """Read the start message; from then on the process ends when the pipe closes."""
        line = bytearray()
        while not line.endswith(b"\n"):
            part = os.read(self._pipe, 65536)
            if not part:
                os._exit(ABANDONED)
            line += part
        threading.Thread(target=self._watch, name="pipe to the emulator", daemon=True).start()
        return msgspec.json.decode(line, type=StartMessage)

    def has_said_all(self) -> None:
        """From now on the end of the pipe is expected: it no longer ends the process."""
        self._done.set()

    def await_end(self, timeout_s: float) -> None:
        """Stay until the emulator has heard the last word and closes the pipe."""
        self._done.set()
        self._closed.wait(timeout_s)

    def _watch(self) -> None:
        while os.read(self._pipe, 1):
            pass
        if not self._done.is_set():
            os._exit(ABANDONED)
        self._closed.set()
