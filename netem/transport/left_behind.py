"""Ends the processes that descendants of this process leave behind.

A daemon (a process in a new session whose parent has ended) belongs to no process group that could be killed. Linux
makes it a child of the nearest ancestor that is a child subreaper (prctl(2)). On other systems it is not ended.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path
from typing import Final

from netem.wire.parent import prctl

CHILD_SUBREAPER: Final = 36             # prctl(2)


def take_orphans() -> None:
    """Make this process a child subreaper: orphans of its descendants become its children."""
    prctl(CHILD_SUBREAPER, 1)


def end_children(but: Collection[int] = ()) -> None:
    """Kill the children of this process and their descendants, except those in `but`, and wait for them."""
    with suppress(OSError):
        while children := [pid for pid in _children() if pid not in but]:
            for pid in children:
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
                with suppress(ChildProcessError):
                    os.waitpid(pid, 0)


def _children() -> list[int]:
    return [int(pid) for pid in Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()]
