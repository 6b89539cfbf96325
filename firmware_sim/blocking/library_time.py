"""The standard library's time and threads in virtual time, for threads of a blocking program; unchanged for others.

    time       sleep, monotonic and perf_counter on the node's oscillator; time on its local clock, 0 is 1 January 1970;
               clock_gettime for both
    threading  Lock, RLock, and with them Condition, Event, Semaphore, Barrier, Timer; Thread: start, join, is_alive
    queue      Queue, SimpleQueue         signal  handlers are kept for the end of the run
    random     the program's own generator (`library_random.py`)

Names are replaced in the modules (`REPLACED`, `replacing.py`). Polls (`library_polls.py`) and readings of a clock are
counted for their cost (`calls_in_a_row.py`). Sockets, `select` and asyncio are in `firmware_sim/sockets`.

Not replaced: `datetime.now()`, files, processes. A wait in one of these stops the node.
"""

from __future__ import annotations

import concurrent.futures.thread
import queue
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

from firmware_sim.blocking.library_polls import POLLS
from firmware_sim.blocking.library_random import RANDOM
from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.blocking.replacing import Replacement, Replacements
from firmware_sim.blocking.seconds import duration_ns
from firmware_sim.blocking.virtual_lock import LockByThread, VirtualLock

TIME_OF_DAY: Final = (time.CLOCK_REALTIME, time.CLOCK_TAI)
SINCE_START: Final = (time.CLOCK_MONOTONIC, time.CLOCK_MONOTONIC_RAW, time.CLOCK_BOOTTIME)
_clock_gettime_really = time.clock_gettime_ns


def _sleep(program: BlockingProgram, seconds: float) -> None:
    if seconds < 0:
        raise ValueError("sleep length must be non-negative")
    program.sleep(duration_ns(seconds))


def _time_ns(program: BlockingProgram) -> int:
    program.note_call()
    return program.board.now_ns


def _time(program: BlockingProgram) -> float:
    program.note_call()
    return program.board.now_ns / 1e9


def _clock_gettime_ns(program: BlockingProgram, clock: int) -> int:
    if clock in TIME_OF_DAY:
        return _time_ns(program)
    return program.monotonic_ns() if clock in SINCE_START else _clock_gettime_really(clock)


def _clock_gettime(program: BlockingProgram, clock: int) -> float:
    return _clock_gettime_ns(program, clock) / 1e9


def _lock(program: BlockingProgram) -> VirtualLock:
    return VirtualLock()


def _rlock(program: BlockingProgram) -> Any:
    return threading._PyRLock()                 # type: ignore[attr-defined]     # uses `threading._allocate_lock`


def _simple_queue(program: BlockingProgram) -> Any:
    return queue._PySimpleQueue()               # type: ignore[attr-defined]     # uses `threading.Semaphore`


def _start(program: BlockingProgram, bootstrap: Callable[[], object], *args: Any, **kwargs: Any) -> Any:
    """Replace the call by which `Thread.start` starts the OS thread; `bootstrap` is a method of the Thread."""
    thread: threading.Thread = bootstrap.__self__       # type: ignore[attr-defined]
    program.os_threads[thread] = program.start(bootstrap, thread.name, daemon=thread.daemon,
                                                spawn=lambda body: _start_joinable(body, *args, **kwargs))


def _join(program: BlockingProgram, thread: threading.Thread, timeout: float | None = None) -> None:
    known = program.os_threads.get(thread)
    if known is None or thread is threading.current_thread():
        _join_real(thread, timeout)
    else:
        program.await_end(known, None if timeout is None else duration_ns(max(0.0, timeout)))
        if timeout is not None and timeout <= 0 and not known.ended:
            program.note_call()


def _is_alive(program: BlockingProgram, thread: threading.Thread) -> bool:
    """Return whether the program's thread runs; the real answer depends on how fast the OS ends a thread."""
    known = program.os_threads.get(thread)
    if known is None:
        return _is_alive_really(thread)
    if not known.ended:
        program.note_call()
    return not known.ended


def _excepthook(program: BlockingProgram, args: threading.ExceptHookArgs) -> None:
    if args.exc_type is not SystemExit:
        program.thread().failure = args.exc_value


def _signal(program: BlockingProgram, number: int, handler: Any) -> Any:
    before = program.handlers.get(number, signal.getsignal(number))
    program.handlers[number] = handler
    return before


def _main_thread(program: BlockingProgram) -> threading.Thread:
    return program.main_thread


STARTS: Final = "_start_joinable_thread" if hasattr(threading, "_start_joinable_thread") else "_start_new_thread"
_start_joinable: Any = getattr(threading, STARTS)       # from Python 3.13 on, and before
_join_real, _is_alive_really = threading.Thread.join, threading.Thread.is_alive
REPLACED: Final[list[Replacement]] = [
    (time, "sleep", _sleep),
    (time, "time", _time),
    (time, "time_ns", _time_ns),
    (time, "monotonic", BlockingProgram.monotonic_s),
    (time, "monotonic_ns", BlockingProgram.monotonic_ns),
    (time, "perf_counter", BlockingProgram.monotonic_s),
    (time, "perf_counter_ns", BlockingProgram.monotonic_ns),
    (time, "clock_gettime", _clock_gettime),
    (time, "clock_gettime_ns", _clock_gettime_ns),
    (threading, "_time", BlockingProgram.monotonic_s),
    (threading, "Lock", _lock),
    (threading, "_allocate_lock", _lock),
    (threading, "RLock", _rlock),
    (threading, STARTS, _start),
    (threading.Thread, "join", _join),
    (threading.Thread, "is_alive", _is_alive),
    (threading, "excepthook", _excepthook),
    (threading, "main_thread", _main_thread),
    (queue, "time", BlockingProgram.monotonic_s),
    (queue, "SimpleQueue", _simple_queue),
    (signal, "signal", _signal),
    *POLLS,
    *RANDOM,
]
_replacements: Final = Replacements(REPLACED)


@contextmanager
def library_in_virtual_time(*, everywhere: bool = False) -> Iterator[None]:
    """Within this context the standard library uses virtual time in threads of blocking programs, and only there.

    `everywhere`: as in `Replacements.in_place`. The lock of all thread pools becomes one for each program.
    """
    pools: Any = concurrent.futures.thread
    lock = pools._global_shutdown_lock
    with _replacements.in_place(everywhere=everywhere):
        pools._global_shutdown_lock = LockByThread(lock, "concurrent.futures.thread")
        try:
            yield
        finally:
            pools._global_shutdown_lock = lock
