"""What the emulator tells a node's process when it starts it: one line of JSON on the standard input.

The pipe stays open for as long as the emulator lives; when it closes, the node's process ends at once.
"""

from __future__ import annotations

import os
import sys
import threading

import msgspec

ABANDONED = 4       # exit code of a node whose emulator is gone


class Errand(msgspec.Struct):
    """`specification` is for whoever builds the node."""

    endpoint: str
    run: str
    node: str
    timeout_s: float
    specification: bytes


def read_errand() -> Errand:
    """Read the errand, and from then on watch the pipe. Unbuffered: a thread that waits in a buffered read would hold
    up the interpreter's exit for a second."""
    pipe = sys.stdin.fileno()
    line = bytearray()
    while not line.endswith(b"\n"):
        part = os.read(pipe, 65536)
        if not part:
            os._exit(ABANDONED)
        line += part
    threading.Thread(target=_end_with_emulator, args=(pipe,), name="pipe to the emulator", daemon=True).start()
    return msgspec.json.decode(line, type=Errand)


def _end_with_emulator(pipe: int) -> None:
    while os.read(pipe, 1):
        pass
    os._exit(ABANDONED)
