"""Batons in Python, used where c_batons.c was not compiled; c_batons.pyi has their contract.

An `EventBaton` is given by a system call, during which the giver has no interpreter's lock, so that the other thread
finds it free. With a `Baton` that thread wakes up, waits for the interpreter's lock, and wakes up again.
"""

from __future__ import annotations

import os
from _thread import allocate_lock  # the real one, whatever `library_time` puts into `threading`

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
    """It cannot be taken with a time-out."""

    def __init__(self) -> None:
        self._file = os.eventfd(0, os.EFD_CLOEXEC)

    def __del__(self) -> None:
        _close(self._file)

    def give(self) -> None:
        os.eventfd_write(self._file, 1)

    def take(self) -> bool:
        return os.eventfd_read(self._file) == 1


def pass_on(to: Baton | EventBaton, own: Baton | EventBaton, timeout_s: float = -1) -> bool:
    """Unlike in C, the interpreter's lock is held between giving and taking."""
    to.give()
    return own.take() if isinstance(own, EventBaton) else own.take(timeout_s)
