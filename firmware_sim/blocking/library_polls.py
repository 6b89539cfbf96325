"""Questions to the standard library that do not wait, each counted as a call (`calls_in_a_row.py`).

A loop such as `while not stop.is_set(): ...` or `while True: queue.get_nowait()` then lets time pass, and other threads
and the node go on. What cannot be counted is a loop that only reads variables: it keeps the node from going on.
"""

from __future__ import annotations

import concurrent.futures
import queue
import threading
from collections.abc import Callable
from typing import Any, Final

from firmware_sim.blocking.program import BlockingProgram

_get_really, _put_really, _acquire_really = queue.Queue.get, queue.Queue.put, threading.Semaphore.acquire
_enumerate_really = threading.enumerate


def _get(program: BlockingProgram, *args: Any, **kwargs: Any) -> Any:
    try:
        return _get_really(*args, **kwargs)
    except queue.Empty:
        program.note_call()
        raise


def _put(program: BlockingProgram, *args: Any, **kwargs: Any) -> None:
    try:
        _put_really(*args, **kwargs)
    except queue.Full:
        program.note_call()
        raise


def _acquire(program: BlockingProgram, *args: Any, **kwargs: Any) -> bool:
    acquired = _acquire_really(*args, **kwargs)
    if not acquired:
        program.note_call()
    return acquired


def _counted(real: Callable[..., Any], *answers: object) -> Callable[..., Any]:
    """`real`, counted as a call if it gives one of `answers`, and then asked anew: the call may have taken time."""
    def asked(program: BlockingProgram, *args: Any, **kwargs: Any) -> Any:
        answer = real(*args, **kwargs)
        if answer in answers:
            program.note_call()
            answer = real(*args, **kwargs)
        return answer

    return asked


def _active_count(program: BlockingProgram) -> int:
    program.note_call()
    return len(_enumerate_really())


def _enumerate(program: BlockingProgram) -> list[threading.Thread]:
    program.note_call()
    return _enumerate_really()


POLLS: Final[list[tuple[Any, str, Callable[..., Any]]]] = [
    (queue.Queue, "get", _get),
    (queue.Queue, "put", _put),
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
