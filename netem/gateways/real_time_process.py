"""Real-time scheduling (SCHED_FIFO) and locked memory for a process, where the machine allows them.

A thread of SCHED_FIFO runs before all usual threads and wakes up without timer slack; locked pages are never written to
disk. Both are asked for every thread that the process has; threads that these start later inherit the scheduling.
The emulator has a higher priority than the nodes, so a node whose code never ends cannot keep it from ending the run.

Source: sched(7), mlockall(2); MCL_ONFAULT since Linux 4.4.
"""

from __future__ import annotations

import ctypes
import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

EMULATOR_PRIORITY: Final = 20       # of 1 to 99
NODE_PRIORITY: Final = 10
_CURRENT, _FUTURE, _ON_FAULT = 1, 2, 4          # flags of mlockall
_MAY_LOCK: Final = 1 << 14                      # CAP_IPC_LOCK in the mask of /proc/self/status
ALLOW_SCHEDULING: Final = "run as root, with CAP_SYS_NICE, or with `rtprio 20` in /etc/security/limits.conf"
ALLOW_LOCKING: Final = "run as root, with CAP_IPC_LOCK, or with `memlock unlimited` in /etc/security/limits.conf"


def schedule_in_real_time(priority: int) -> str:
    """Give every thread of this process SCHED_FIFO with `priority`; return "" or why not, with the remedy."""
    try:
        for thread in _threads():
            with suppress(ProcessLookupError):          # it has ended
                os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(priority))
    except OSError as error:
        return f"no real-time scheduling ({error.strerror}): {ALLOW_SCHEDULING}"
    return ""


def lock_memory() -> str:
    """Keep this process's memory from being written to disk; return "" or why not, with the remedy.

    A process with a limit is refused even below it, as each later allocation beyond the limit would fail.
    """
    unlimited = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY
    if not unlimited and not _capabilities() & _MAY_LOCK:
        return f"memory is not locked (limited by RLIMIT_MEMLOCK): {ALLOW_LOCKING}"
    library = ctypes.CDLL(None, use_errno=True)
    if library.mlockall(_CURRENT | _FUTURE | _ON_FAULT):
        return f"memory is not locked ({os.strerror(ctypes.get_errno())}): {ALLOW_LOCKING}"
    return ""


@contextmanager
def in_real_time(priority: int) -> Iterator[list[str]]:
    """Schedule this process in real time and lock its memory during the `with` block; yields what was not allowed."""
    before = {thread: (os.sched_getscheduler(thread), os.sched_getparam(thread)) for thread in _threads()}
    refused = [why for why in (schedule_in_real_time(priority), lock_memory()) if why]
    try:
        yield refused
    finally:
        for thread in _threads():               # those started meanwhile get what threads usually have
            policy, parameter = before.get(thread, (os.SCHED_OTHER, os.sched_param(0)))
            with suppress(OSError):
                os.sched_setscheduler(thread, policy, parameter)
        ctypes.CDLL(None).munlockall()


def _threads() -> list[int]:
    return [int(entry.name) for entry in Path("/proc/self/task").iterdir()]


def _capabilities() -> int:
    """Return the effective capabilities of this process as a mask; 0 if the system does not tell them."""
    with suppress(OSError):
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("CapEff:"):
                return int(line.split()[1], 16)
    return 0
