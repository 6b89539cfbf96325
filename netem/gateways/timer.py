"""A timer that expires at an instant of the monotonic clock and is waited for as a file, together with others.

A selector's own time-out is rounded up to 1 ms (`epoll_wait`), and the kernel may prolong it by the timer slack, 50 us
or 1/1000 of the time-out. A `timerfd` expires at an absolute instant, without slack (timerfd_create(2)).
"""

from __future__ import annotations

import ctypes
import os
from typing import Any, Final

NS_PER_S: Final = 1_000_000_000
_ABSOLUTE: Final = 1                # TFD_TIMER_ABSTIME
_MONOTONIC: Final = 1               # CLOCK_MONOTONIC, the clock of `time.monotonic_ns`


class _Instant(ctypes.Structure):   # struct timespec
    _fields_ = (("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long))


class _Setting(ctypes.Structure):   # struct itimerspec
    _fields_ = (("interval", _Instant), ("value", _Instant))


class Timer:
    """A file that can be read once the monotonic clock has reached the instant of the last `set`."""

    def __init__(self) -> None:
        """Raises OSError if the system gives no timer, as when too many files are open."""
        self._library: Any = ctypes.CDLL(None, use_errno=True)
        self._fd = self._library.timerfd_create(_MONOTONIC, os.O_NONBLOCK | os.O_CLOEXEC)
        if self._fd < 0:
            raise OSError(ctypes.get_errno(), f"no timer for a run in real time: {os.strerror(ctypes.get_errno())}")
        self._setting = _Setting()
        self._at_ns = -1

    def fileno(self) -> int:
        return int(self._fd)

    def set(self, at_ns: int) -> None:
        """Expire when `time.monotonic_ns` reaches `at_ns`, instead of at any instant set before."""
        if at_ns != self._at_ns:
            self._at_ns = at_ns
            value = self._setting.value
            value.seconds, value.nanoseconds = divmod(max(at_ns, 1), NS_PER_S)      # 0 would stop the timer
            self._library.timerfd_settime(self._fd, _ABSOLUTE, ctypes.byref(self._setting), None)

    def close(self) -> None:
        os.close(self._fd)
