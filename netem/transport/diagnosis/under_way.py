"""A record of the code that a process runs, in memory that another process can read after a crash.

    word 0                  number of the node whose code runs in an inline run, from 1; 0 between nodes
    word 1                  offset of the name of the FMI call that runs; 0 between calls
    word 2                  1 while a debugger holds the code that runs, so that time-outs stand still
    names                   UTF-8, each ended by a zero byte
    -- MEMORY_BYTES --
    stacks                  what Python's fault handler wrote (`stack_dump.py`)

Words are 64-bit integers. A name is written once, when a plant is built; a call then costs two stores.
"""

from __future__ import annotations

import mmap
import os
import struct
import sys
from contextlib import suppress
from functools import cached_property
from typing import Any, Final

MEMORY_BYTES: Final = 1 << 20
WORDS_BYTES: Final = 24
LONGEST_NAME: Final = 200
LONGEST_STACKS: Final = 1 << 18


class UnderWay:
    """Memory of this process, or the memory of another `UnderWay` whose descriptor is `file`.

    If `shared`, another process reads the memory through its descriptor; otherwise there is no descriptor.
    """

    def __init__(self, file: int | None = None, *, shared: bool = True) -> None:
        self.shared = shared
        if file is None:
            file = -1
            if shared:
                file = os.memfd_create("under way", os.MFD_CLOEXEC)
                os.ftruncate(file, MEMORY_BYTES)
                os.lseek(file, MEMORY_BYTES, os.SEEK_SET)       # the fault handler writes from here on
        self.file = file
        self._places: dict[str, int] = {}
        self._end = WORDS_BYTES

    @cached_property
    def _mapping(self) -> mmap.mmap:
        return mmap.mmap(self.file, MEMORY_BYTES)

    @cached_property
    def _memory(self) -> memoryview:
        """The memory for writing. A process that only reads does without, as a mapping takes a second descriptor."""
        return memoryview(self._mapping)

    @cached_property
    def words(self) -> memoryview:
        return self._memory[:WORDS_BYTES].cast("q")

    def word_0(self, most: int) -> Any:
        """Return an object whose item 0 is word 0, for numbers from 0 to `most`.

        If these fit into a byte it is the mapping itself, as setting a byte costs less than setting an item of `words`.
        """
        return self._mapping if most < 256 and sys.byteorder == "little" else self.words

    @cached_property
    def call_word(self) -> memoryview:
        return self.words[1:2]

    @cached_property
    def hold_word(self) -> memoryview:
        return self.words[2:3]

    def place(self, call: str) -> int:
        """Return the value of word 1 for an FMI call of this name; 0, which stands for no name, if memory is full."""
        if call not in self._places:
            name = call.encode(errors="replace")[:LONGEST_NAME] + b"\0"
            if self._end + len(name) > MEMORY_BYTES:
                return 0
            self._memory[self._end:self._end + len(name)] = name
            self._places[call] = self._end
            self._end += len(name)
        return self._places[call]

    def call(self) -> str:
        """Name of the FMI call that runs, "" between calls or if the process has overwritten the memory."""
        _, start, _ = self._words_read()
        if not WORDS_BYTES <= start < MEMORY_BYTES:
            return ""
        return self._read(start, min(start + LONGEST_NAME, MEMORY_BYTES)).partition(b"\0")[0].decode(errors="replace")

    def running(self) -> int:
        """Word 0: the number of the node whose code runs, 0 between nodes."""
        return self._words_read()[0]

    def held(self) -> bool:
        """Whether a debugger holds the code that runs."""
        return self._words_read()[2] == 1

    def _words_read(self) -> tuple[int, int, int]:
        first, second, third = struct.unpack("qqq", self._read(0, WORDS_BYTES))
        return first, second, third

    def _read(self, start: int, end: int) -> bytes:
        return os.pread(self.file, end - start, start) if self.shared else bytes(self._memory[start:end])

    def stacks(self) -> str:
        """Text that the fault handler has written so far."""
        if not self.shared:
            return ""
        return os.pread(self.file, LONGEST_STACKS, MEMORY_BYTES).decode(errors="replace")

    def close(self) -> None:
        """Close the descriptor; the system frees the memory when no plant's mapping of it is left."""
        with suppress(OSError):
            os.close(self.file)
