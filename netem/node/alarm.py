"""An alarm clock on SimPy's queue: cheaper than a process that waits, or than an event that one could wait for."""

from __future__ import annotations

from collections.abc import Callable
from heapq import heappush
from typing import Any

from simpy.events import NORMAL

from netem.node.environment import NodeEnvironment


class Alarm:
    """As much of an event as SimPy's queue asks for."""

    __slots__ = ("_ok", "callbacks")

    def __init__(self, action: Callable[[Any], None]) -> None:
        self.callbacks: list[Callable[[Any], None]] | None = [action]
        self._ok = True


def call_in(env: NodeEnvironment, delay_ns: int, action: Callable[[Any], None]) -> None:
    """Call `action` after `delay_ns`, among the events of that instant."""
    heappush(env.queue, (env._now + delay_ns, NORMAL, next(env._eid), Alarm(action)))
