"""Lets Python's fault handler write the stacks behind the memory of `UnderWay`, at a crash and at `DUMP_SIGNAL`.

The fault handler runs within the signal handler, so it works while a long call into C holds the interpreter.
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
    """Install the fault handler; with `then_end`, `DUMP_SIGNAL` also ends the process after the dump."""
    faulthandler.enable(under_way.file, all_threads=True)
    faulthandler.register(DUMP_SIGNAL, under_way.file, all_threads=True, chain=then_end)


def ask_for_dump(pid: int) -> None:
    """Send `DUMP_SIGNAL` to the main thread of a process and continue it, as a stopped process handles no signals.

    If the process as a whole got the signal, any thread might handle it, after the main thread has left the line at
    which it was stopped. Raises ProcessLookupError if the process has ended.
    """
    tgkill = getattr(ctypes.CDLL(None, use_errno=True), "tgkill", None)         # missing in other libraries than glibc
    if tgkill is None or tgkill(pid, pid, int(DUMP_SIGNAL)):
        os.kill(pid, DUMP_SIGNAL)
    os.kill(pid, signal.SIGCONT)


def await_dump(under_way: UnderWay, ask: Callable[[], None]) -> None:
    """Call `ask`, which requests a dump from a process; returns when it is written, or after `DUMP_WITHIN_S`."""
    before = written = under_way.stacks()
    ask()
    deadline_s = time.monotonic() + DUMP_WITHIN_S
    while time.monotonic() < deadline_s:
        time.sleep(DUMP_LOOK_S)
        earlier, written = written, under_way.stacks()
        if written == earlier != before:            # the dump has begun, and has not grown since the last look
            return
