"""Batons in Python, used where c_batons.c was not compiled; c_batons.pyi has their contract.

An `EventBaton` is given by a system call, during which the giver has no interpreter's lock, so that the other thread
finds it free. With a `Baton` that thread wakes up, waits for the interpreter's lock, and wakes up again.
"""

from __future__ import annotations

import os
from _thread import allocate_lock  # the real one, whatever `library_time` puts into `threading`
from contextlib import suppress

_close = os.close


class Baton:
    def __init__(self) -> None:
        self._lock = allocate_lock()
        self._lock.acquire()

    def give(self) -> None:
        self._lock.release()

    def take(self, timeout_s: float = -1) -> bool:
        return self._lock.acquire(timeout=-1 if timeout_s < 0 else timeout_s)


class EventBaton:
    """A baton that cannot be taken with a time-out."""

    _file = -1              # if the system has none left

    def __init__(self) -> None:
        self._file = os.eventfd(0, os.EFD_CLOEXEC)

    def __del__(self) -> None:
        if self._file >= 0:
            _close(self._file)

    def give(self) -> None:
        os.eventfd_write(self._file, 1)

    def take(self) -> bool:
        while True:
            with suppress(InterruptedError):        # by a signal that reached this thread; the main thread handles it
                return os.eventfd_read(self._file) == 1


def pass_on(to: Baton | EventBaton, own: Baton | EventBaton, timeout_s: float = -1) -> bool:
    """Unlike in C, the interpreter's lock is held between giving and taking."""
    to.give()
    return own.take() if isinstance(own, EventBaton) else own.take(timeout_s)
