"""The start message: one line of JSON that the emulator writes to the standard input of a node's process.

The pipe stays open for as long as the emulator lives; when it closes, the node's process ends at once.
"""

from __future__ import annotations

import os
import sys
import threading

import msgspec

from netem.wire.messages import Life

ABANDONED = 4       # exit code of a node whose emulator has ended


class StartMessage(msgspec.Struct):
    """Tells a node how to reach the emulator; `specification` is the argument of the function that builds the node.

    `secret` is the password of the emulator's Zenoh session. In virtual time an `OutsideGuard` watches the program.
    """

    endpoint: str
    secret: str
    run: str
    node: str
    timeout_s: float
    specification: bytes
    virtual_time: bool = True
    life: Life | None = None        # of a node that was killed
    priority: int = 0               # of its real-time scheduling, with its memory locked; 0: usual scheduling


class EmulatorPipe:
    """The pipe from the emulator, until then the standard input of the node's process.

    The program and the processes that it starts get an empty standard input instead. The pipe is read unbuffered: a
    thread that waits in a buffered read would delay the interpreter's exit by a second.
    """

    def __init__(self) -> None:
        standard_input = sys.stdin.fileno()
        self._pipe = os.dup(standard_input)
        with open(os.devnull, "rb") as nothing:
            os.dup2(nothing.fileno(), standard_input)
        self._done = threading.Event()
        self._closed = threading.Event()

    def read_start_message(self) -> StartMessage:
        """Read the start message; from then on the process ends with `ABANDONED` when the pipe closes."""
        line = bytearray()
        while not line.endswith(b"\n"):
            part = os.read(self._pipe, 65536)
            if not part:
                os._exit(ABANDONED)
            line += part
        threading.Thread(target=self._watch, name="pipe to the emulator", daemon=True).start()
        return msgspec.json.decode(line, type=StartMessage)

    def expect_end(self) -> None:
        """From now on the process goes on when the pipe closes."""
        self._done.set()

    def await_end(self, timeout_s: float) -> None:
        """Wait until the emulator, which has received the last message, closes the pipe, at most `timeout_s`."""
        self._done.set()
        self._closed.wait(timeout_s)

    def _watch(self) -> None:
        while os.read(self._pipe, 1):
            pass
        if not self._done.is_set():
            os._exit(ABANDONED)
        self._closed.set()
