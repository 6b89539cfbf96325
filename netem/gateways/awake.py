"""Keeps processors from idling, since one that has been idle wakes up late.

An idle processor of a computer falls into sleep states, from which it returns after up to some 0.1 ms; that of a
virtual machine is taken back by the host, which returns it after up to some ms. Against the first Linux offers a file:
as long as a process holds `/dev/cpu_dma_latency` open with 0 in it, idle processors poll. A kernel without a driver of
idle states, as in most virtual machines, heeds no such wish. There a thread for each processor spins, with the lowest
of all priorities (SCHED_IDLE): any other thread runs before it, and the host sees no idle processor.

Source: Documentation/power/pm_qos_interface.rst and Documentation/admin-guide/pm/cpuidle.rst of Linux; sched(7).
"""

from __future__ import annotations

import ctypes
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

IDLE_DRIVER: Final = Path("/sys/devices/system/cpu/cpuidle/current_driver")
LATENCY: Final = Path("/dev/cpu_dma_latency")
ALLOW_LATENCY: Final = f"run as root, or let a udev rule give your group the right to write {LATENCY}"
MOST_S: Final = 1.0                 # for a thread to begin or to end


@contextmanager
def awake(processors: set[int]) -> Iterator[str]:
    """Keep `processors` from idling during the `with` block, which gets "" or why not, with the remedy."""
    if _idle_driver():
        try:
            held = os.open(LATENCY, os.O_WRONLY | os.O_CLOEXEC)
        except OSError as error:
            yield f"idle processors sleep ({error.strerror}: {LATENCY}): {ALLOW_LATENCY}"
            return
        try:
            os.write(held, bytes(4))                # an int32 of 0 us
            yield ""
        finally:
            os.close(held)
        return
    spinning = Spinning(processors)
    try:
        yield ""
    finally:
        spinning.close()


class Spinning:
    """A thread on each of some processors that spins with the lowest priority, without the interpreter's lock."""

    def __init__(self, processors: set[int]) -> None:
        self._library = ctypes.CDLL(None)           # its calls release the interpreter's lock
        self._lock = ctypes.c_int()                 # a pthread_spinlock_t: a thread that waits for it spins
        self._library.pthread_spin_init(ctypes.byref(self._lock), 0)
        self._library.pthread_spin_lock(ctypes.byref(self._lock))
        self._threads: list[threading.Thread] = []
        for processor in sorted(processors):
            begun = threading.Event()
            thread = threading.Thread(target=self._spin, args=(processor, begun), daemon=True)
            thread.start()
            self._threads.append(thread)
            begun.wait(MOST_S)

    def close(self) -> None:
        for thread in self._threads:                # the lowest priority may not get far on a busy processor
            with suppress(OSError):
                os.sched_setscheduler(thread.native_id or 0, os.SCHED_OTHER, os.sched_param(0))
        self._library.pthread_spin_unlock(ctypes.byref(self._lock))
        for thread in self._threads:
            thread.join(MOST_S)

    def _spin(self, processor: int, begun: threading.Event) -> None:
        os.sched_setaffinity(0, {processor})
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
        begun.set()
        self._library.pthread_spin_lock(ctypes.byref(self._lock))
        self._library.pthread_spin_unlock(ctypes.byref(self._lock))


def _idle_driver() -> str:
    """Return the name of the kernel's driver of idle states, or "" if it has none."""
    with suppress(OSError):
        name = IDLE_DRIVER.read_text().strip()
        return "" if name == "none" else name
    return ""
