"""Orphans of a process's children: they become its own children, and it ends them when it ends.

A daemon (a new session, its parent gone) belongs to no process group that could be killed; Linux hands it to the
nearest ancestor that said it takes such children. Elsewhere nothing is done.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path
from typing import Final

CHILD_SUBREAPER: Final = 36             # prctl(2)
DEATH_SIGNAL: Final = 1


def take_orphans() -> None:
    """From now on what a descendant leaves behind is a child of this process."""
    _prctl(CHILD_SUBREAPER, 1)


def end_with_parent(number: int) -> None:
    """Let this process get the signal `number` when its parent ends."""
    _prctl(DEATH_SIGNAL, number)


def end_children(but: Collection[int] = ()) -> None:
    """Kill the children of this process and theirs, and wait for them; those in `but` stay."""
    with suppress(OSError):
        while children := [pid for pid in _children() if pid not in but]:
            for pid in children:
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
                with suppress(ChildProcessError):
                    os.waitpid(pid, 0)


def _children() -> list[int]:
    return [int(pid) for pid in Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()]


def _prctl(option: int, value: int) -> None:
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(option, value, 0, 0, 0)
