"""Polls of the standard library, calls that do not wait, each counted for its cost (`calls_in_a_row.py`).

Then a loop such as `while not stop.is_set(): ...` or `while True: queue.get_nowait()` lets time pass, and other threads
and the node go on. A loop that only reads variables cannot be counted: it stops the node.
"""

from __future__ import annotations

import concurrent.futures
import queue
import threading
from collections.abc import Callable
from typing import Any, Final

from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.blocking.replacing import Replacement

_acquire_really, _enumerate_really = threading.Semaphore.acquire, threading.enumerate


def _refusing(real: Callable[..., Any], refusal: type[Exception]) -> Callable[..., Any]:
    """Return `real` wrapped: a call that raises `refusal` is counted."""
    def asked(program: BlockingProgram, *args: Any, **kwargs: Any) -> Any:
        try:
            return real(*args, **kwargs)
        except refusal:
            program.note_call()
            raise

    return asked


def _acquire(program: BlockingProgram, *args: Any, **kwargs: Any) -> bool:
    acquired = _acquire_really(*args, **kwargs)
    if not acquired:
        program.note_call()
    return acquired


def _counted(real: Callable[..., Any], *answers: object) -> Callable[..., Any]:
    """Return `real` wrapped: a result in `answers` is counted as a call, and `real` is called again after its cost."""
    def asked(program: BlockingProgram, *args: Any, **kwargs: Any) -> Any:
        answer = real(*args, **kwargs)
        if answer in answers:
            program.note_call()
            answer = real(*args, **kwargs)
        return answer

    return asked


def _active_count(program: BlockingProgram) -> int:
    return len(_enumerate(program))


def _enumerate(program: BlockingProgram) -> list[threading.Thread]:
    """Return the threads of the program, not those of others in its process."""
    program.note_call()
    return [thread for thread in _enumerate_really() if thread in program.os_threads]


POLLS: Final[list[Replacement]] = [
    (queue.Queue, "get", _refusing(queue.Queue.get, queue.Empty)),
    (queue.Queue, "put", _refusing(queue.Queue.put, queue.Full)),
    (queue.Queue, "empty", _counted(queue.Queue.empty, True)),
    (queue.Queue, "full", _counted(queue.Queue.full, True)),
    (queue.Queue, "qsize", _counted(queue.Queue.qsize, 0)),
    (queue._PySimpleQueue, "empty", _counted(queue._PySimpleQueue.empty, True)),            # type: ignore[attr-defined]
    (queue._PySimpleQueue, "qsize", _counted(queue._PySimpleQueue.qsize, 0)),               # type: ignore[attr-defined]
    (threading.Event, "is_set", _counted(threading.Event.is_set, True, False)),
    (threading.Semaphore, "acquire", _acquire),
    (threading, "active_count", _active_count),
    (threading, "enumerate", _enumerate),
    (concurrent.futures.Future, "running", _counted(concurrent.futures.Future.running, True)),
    (concurrent.futures.Future, "done", _counted(concurrent.futures.Future.done, False)),
]
