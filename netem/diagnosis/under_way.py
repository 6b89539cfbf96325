"""What code of a process runs, kept in memory that another process can read after a crash.

    word 0                  the node whose code runs in an inline run, counted from 1; 0 between nodes
    word 1                  where below the name of the FMI call under way starts; 0 between calls
    names                   UTF-8, each ended by a zero byte
    -- MEMORY_BYTES --
    stacks                  what Python's fault handler wrote (`stack_dump.py`)

Words are 64-bit integers. A name is written once, when a plant is built; a call then costs two stores.
"""

from __future__ import annotations

import mmap
import os
from contextlib import suppress
from typing import Final

MEMORY_BYTES: Final = 1 << 20
WORDS_BYTES: Final = 16
LONGEST_NAME: Final = 200
LONGEST_STACKS: Final = 1 << 18


class UnderWay:
    """Memory of its own, or that of `file`, the descriptor of another one's memory.

    `shared`: another process reads it, and says what it finds there.
    """

    def __init__(self, file: int | None = None, *, shared: bool = True) -> None:
        self.shared = shared
        if file is None:
            file = os.memfd_create("under way", os.MFD_CLOEXEC)
            os.ftruncate(file, MEMORY_BYTES)
            os.lseek(file, MEMORY_BYTES, os.SEEK_SET)       # stacks are written from here on
        self.file = file
        self._memory = memoryview(mmap.mmap(file, MEMORY_BYTES))
        self.words = self._memory[:WORDS_BYTES].cast("q")
        self.call_word = self.words[1:2]
        self._places: dict[str, int] = {}
        self._end = WORDS_BYTES

    def place(self, call: str) -> int:
        """The number that stands for this name in word 1; 0, so no name, when the memory is full."""
        if call not in self._places:
            name = call.encode(errors="replace")[:LONGEST_NAME] + b"\0"
            if self._end + len(name) > MEMORY_BYTES:
                return 0
            self._memory[self._end:self._end + len(name)] = name
            self._places[call] = self._end
            self._end += len(name)
        return self._places[call]

    def call(self) -> str:
        """The name of the FMI call under way, "" between calls. A process may have written anything: none is an error.
        """
        start = self.words[1]
        if not WORDS_BYTES <= start < MEMORY_BYTES:
            return ""
        return bytes(self._memory[start:start + LONGEST_NAME]).partition(b"\0")[0].decode(errors="replace")

    def stacks(self) -> str:
        """What the fault handler has written up to now."""
        return os.pread(self.file, LONGEST_STACKS, MEMORY_BYTES).decode(errors="replace")

    def close(self) -> None:
        """Close the descriptor; the memory goes when no plant writes to it any more."""
        with suppress(OSError):
            os.close(self.file)
