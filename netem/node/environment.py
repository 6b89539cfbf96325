"""SimPy, in the way a node needs it: times are integers, and an arriving frame can move the time on like an event.

A node runs its events itself (`Node`), so that the compiled code does it; `step` does the same in Python.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import simpy

from netem.wire.instants import NEVER_NS


class NodeEnvironment(simpy.Environment):
    _now: Any           # int, unless a program waits for a float, which `Node` refuses

    def __init__(self) -> None:
        super().__init__(initial_time=0)
        self.queue: list[tuple[Any, Any, int, Any]] = self._queue        # a heap by time
        self.time_ns: Callable[[], int] = partial(getattr, self, "_now")     # read often: no Python on the way

    def next_ns(self) -> int:
        """Time of the next event, `NEVER_NS` if there is none."""
        return int(self.queue[0][0]) if self.queue else NEVER_NS

    def move_to(self, time_ns: int) -> None:
        """Set the time; every event before `time_ns` has run."""
        assert self._now <= time_ns, f"{time_ns} ns lies before {self._now} ns"
        self._now = time_ns
