"""Python's fault handler of this process writes behind the memory of `UnderWay`: at a crash, and at `DUMP_SIGNAL`.

It runs in the signal handler itself, so it also shows a process whose interpreter is held by one long call into C.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import signal
import time
from collections.abc import Callable
from typing import Final

from netem.transport.diagnosis.under_way import UnderWay

DUMP_SIGNAL: Final = signal.SIGRTMAX - 5        # programs use SIGUSR1 and SIGUSR2 for their own purposes
DUMP_WITHIN_S: Final = 2.0
DUMP_LOOK_S: Final = 0.05


def dump_stacks_into(under_way: UnderWay, *, then_end: bool = False) -> None:
    """`then_end`: `DUMP_SIGNAL` also ends the process, before its programs go on."""
    faulthandler.enable(under_way.file, all_threads=True)
    faulthandler.register(DUMP_SIGNAL, under_way.file, all_threads=True, chain=then_end)


def ask_for_dump(pid: int) -> None:
    """Let the process write its stacks, even if it is stopped: such a process takes signals when it goes on.

    The signal is for its main thread. One for the whole process would be taken by whichever thread goes on first, and
    the main thread would have left the line at which it was stopped. Raises ProcessLookupError if it has ended.
    """
    tgkill = getattr(ctypes.CDLL(None, use_errno=True), "tgkill", None)         # of glibc; else the whole process
    if tgkill is None or tgkill(pid, pid, int(DUMP_SIGNAL)):
        os.kill(pid, DUMP_SIGNAL)
    os.kill(pid, signal.SIGCONT)


def await_dump(under_way: UnderWay, ask: Callable[[], None]) -> None:
    """Call `ask`, which asks a process for its stacks; returns when they are written, or after `DUMP_WITHIN_S`."""
    before = written = under_way.stacks()
    ask()
    deadline_s = time.monotonic() + DUMP_WITHIN_S
    while time.monotonic() < deadline_s:
        time.sleep(DUMP_LOOK_S)
        earlier, written = written, under_way.stacks()
        if written == earlier != before:            # it has written something, and nothing more since
            return
