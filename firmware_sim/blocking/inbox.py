"""A queue of items received for a blocking program; a thread that takes from an empty one waits for a frame."""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.blocking.program_thread import ProgramThread
from netem.wire.instants import NEVER_NS

T = TypeVar("T")


class Inbox(Generic[T]):
    """Holds at most `room` items, any number for 0; a new item replaces the oldest of a full inbox."""

    def __init__(self, program: BlockingProgram, room: int = 0) -> None:
        if room < 0:
            raise ValueError(f"room={room}: expected 0 (for any number of items) or more")
        self._program = program
        self._room = room
        self._items: deque[T] = deque()
        self._takers: deque[ProgramThread] = deque()

    def __len__(self) -> int:
        return len(self._items)

    def put(self, item: T) -> bool:
        """Add an item; returns False if the oldest one was dropped for it."""
        fits = not self._room or len(self._items) < self._room
        if not fits:
            self._items.popleft()
        self._items.append(item)
        if self._takers:
            self._program.wake(self._takers[0])
        return fits

    def take(self, timeout_ns: int | None) -> T | None:
        """Return the oldest item; None if none arrives within `timeout_ns` of the oscillator (None: wait for ever)."""
        program = self._program
        if not self._items and timeout_ns == 0:
            program.note_call()
        if self._items:
            program.thread().row.end()
            return self._items.popleft()
        if timeout_ns == 0:
            return None
        until_ns = NEVER_NS if timeout_ns is None else program.due_ns(timeout_ns)
        thread = program.thread()
        self._takers.append(thread)
        try:
            while not self._items and program.wait(until_ns, hears=True):
                pass
            return self._items.popleft() if self._items else None
        finally:
            self._takers.remove(thread)
            if self._items and self._takers:
                program.wake(self._takers[0])
