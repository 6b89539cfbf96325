"""SimPy, in the way a node needs it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import simpy
from simpy.events import Event

from netem.agenda import NEVER_NS


class NodeEnvironment(simpy.Environment):
    """SimPy's environment in integer nanoseconds, whose time an arriving frame can move on as well as an event."""

    _now: Any           # int, unless a program waits for a float, which `Node` refuses

    def __init__(self) -> None:
        super().__init__(initial_time=0)
        self.queue: list[tuple[Any, Any, int, Any]] = self._queue        # a heap by time

    def next_ns(self) -> int:
        """Time of the next event, `NEVER_NS` if there is none."""
        return int(self.queue[0][0]) if self.queue else NEVER_NS

    def time_ns(self) -> int:
        now_ns: int = self._now
        return now_ns

    def move_to(self, time_ns: int) -> None:
        """Set the time; every event before `time_ns` has run."""
        assert self._now <= time_ns, f"{time_ns} ns lies before {self._now} ns"
        self._now = time_ns


class Alarm(Event):
    """Calls `action` when it is due; cheaper than a process that waits."""

    def __init__(self, env: simpy.Environment, action: Callable[[Event], None]) -> None:
        self.env = env
        self.callbacks = [action]
        self._value = None
        self._ok = True
