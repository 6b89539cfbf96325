"""`threading.Lock` for the threads of a blocking program: a thread that waits for it waits in virtual time.

Everything in `threading` and `queue` that waits (Condition, Event, Semaphore, Queue, ...) is built on this lock.
"""

from __future__ import annotations

from collections import deque
from types import TracebackType
from typing import Any

from firmware_sim.blocking.here import running, this_program
from firmware_sim.blocking.program_thread import ProgramThread
from firmware_sim.blocking.seconds import duration_ns
from netem.wire.instants import NEVER_NS


class VirtualLock:
    def __init__(self) -> None:
        self._held = False
        self._waiting: deque[ProgramThread] = deque()

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
        if timeout != -1 and (not blocking or timeout < 0):
            raise ValueError("can't specify a timeout for a non-blocking call" if not blocking
                             else "timeout value must be a non-negative number")
        if not self._held:
            self._held = True
            return True
        if not blocking or timeout == 0:
            if (program := running()) is not None:
                program.note_call()
            return False
        return self._wait(timeout)

    def _wait(self, timeout: float) -> bool:
        program = this_program()
        until_ns = NEVER_NS if timeout == -1 else program.due_ns(duration_ns(timeout))
        thread = program.thread()
        self._waiting.append(thread)
        try:
            while self._held:
                if not program.wait(until_ns) and self._held:
                    return False
            self._held = True
            return True
        finally:
            self._waiting.remove(thread)

    def release(self) -> None:
        if not self._held:
            raise RuntimeError("release unlocked lock")
        self._held = False
        if self._waiting and (program := running()) is not None:
            if not program.owns(self._waiting[0]):
                raise RuntimeError(f"{self._waiting[0].name} waits for a lock that node {program.node.name} holds: the "
                                   "module that made the lock is shared by both; run them with --host process")
            program.wake(self._waiting[0])

    def locked(self) -> bool:
        if self._held and (program := running()) is not None:
            program.note_call()
        return self._held

    def _is_owned(self) -> bool:
        """Return whether the lock is held; `threading.Condition`, without this method, would try to acquire it."""
        return self._held

    def __enter__(self) -> bool:
        return self.acquire()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 where: TracebackType | None) -> None:
        self.release()

    def _at_fork_reinit(self) -> None:
        self._held = False
        self._waiting.clear()

    def __repr__(self) -> str:
        return f"<{'locked' if self._held else 'unlocked'} lock in virtual time>"


class LockByThread:
    """Stands for a module's lock `name`: each program gets a lock of its own, other threads get `real`."""

    def __init__(self, real: Any, name: str) -> None:
        self._real = real
        self._key = "lock", name

    def _of_this_thread(self) -> Any:
        program = running()
        return self._real if program is None else program.shared.setdefault(self._key, VirtualLock())

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
        return bool(self._of_this_thread().acquire(blocking, timeout))

    def release(self) -> None:
        self._of_this_thread().release()

    def __enter__(self) -> bool:
        return self.acquire()

    def __exit__(self, *error: object) -> None:
        self.release()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._real, name)
