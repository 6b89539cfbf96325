"""Reads the stacks that Python's fault handler wrote, and finds the user's thread and line in them.

    Current thread 0x00007f3c (most recent call first):
      File "/home/me/robots.py", line 72 in act
      File ".../simpy/events.py", line 392 in _resume
"""

from __future__ import annotations

import linecache
import re
from collections.abc import Sequence
from typing import Final, NamedTuple

from netem.wire.program_errors import is_authors

_THREAD: Final = re.compile(r"^(Current thread|Thread) 0x")
_FRAME: Final = re.compile(r'^  File "(?P<file>.*)", line (?P<line>\d+) in (?P<function>.*)$')


class Frame(NamedTuple):
    file: str
    line: int
    function: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line} in {self.function}"


def threads_of(dump: str) -> list[list[Frame]]:
    """Return each thread's frames, innermost first; the thread that received the signal comes first.

    If the text holds several dumps, the thread of the last one comes first.
    """
    threads: list[list[Frame]] = []
    current: list[list[Frame]] = []
    for line in dump.splitlines():
        if thread := _THREAD.match(line):
            frames: list[Frame] = []
            if thread[1] == "Current thread":
                current = [frames]
            threads.append(frames)
        elif (frame := _FRAME.match(line)) and threads:
            threads[-1].append(Frame(frame["file"], int(frame["line"]), frame["function"]))
    return [*current, *(frames for frames in threads if not any(frames is first for first in current))]


def frames_to_show(dump: str) -> list[Frame]:
    """Frames of the thread in which the user's code runs; if there is none, of the one that received the signal."""
    threads = [frames for frames in threads_of(dump) if frames]
    return next((frames for frames in threads if any(map(is_users, frames))), threads[0] if threads else [])


def place_of(frames: Sequence[Frame]) -> Frame | None:
    """The innermost frame of the user's code; if there is none, the innermost of all."""
    return next((frame for frame in frames if is_users(frame)), frames[0] if frames else None)


def is_users(frame: Frame) -> bool:
    """Whether a frame belongs neither to marconet nor to Python or an installed package."""
    return is_authors(frame.file)


def as_traceback(frames: Sequence[Frame]) -> str:
    """Write the frames as Python does, innermost last, with the source line if its file can be read.

    Frames that called the user's code are left out.
    """
    first = max((index for index, frame in enumerate(frames) if is_users(frame)), default=len(frames) - 1)
    lines = []
    for file, number, function in reversed(frames[:first + 1]):
        lines.append(f'  File "{file}", line {number}, in {function}\n')
        if source := linecache.getline(file, number).strip():
            lines.append(f"    {source}\n")
    return "Stack (most recent call last):\n" + "".join(lines) if lines else ""
