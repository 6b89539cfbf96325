"""SimPy's environment for a node: times are integers, and an arriving frame can advance the time like an event.

Only this file uses SimPy's private fields; `tests/netem/node/test_simpy_fields.py` lists them and pins SimPy's version.
The event loop is SimPy's `step` in a form that mypyc compiles.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from heapq import heapify, heappop, heappush
from typing import Any, Final

from mypy_extensions import mypyc_attr
from simpy.core import Environment  # by this path, where mypyc looks for a base class
from simpy.events import NORMAL, Timeout

from netem.wire.instants import NEVER_NS

MAX_EVENTS_AT_ONE_INSTANT: Final = 100_000


class Alarm:
    """The fields of an event that SimPy's queue needs; cheaper than a process or a Timeout."""

    __slots__ = ("_ok", "callbacks")

    def __init__(self, action: Callable[[Any], None]) -> None:
        self.callbacks: list[Callable[[Any], None]] | None = [action]
        self._ok = True


@mypyc_attr(native_class=False)
class Clock:
    __slots__ = ("now_ns",)

    now_ns: Any         # int, unless a program waits for a float, which `Node` refuses


@mypyc_attr(native_class=False)
class NodeEnvironment(Clock, Environment):
    _now = Clock.__dict__["now_ns"]     # SimPy's name for the same slot; neither needs a call to be read or set

    def __init__(self, from_ns: int = 0) -> None:
        super().__init__(initial_time=from_ns)
        self.queue: list[tuple[Any, Any, int, Any]] = self._queue        # a heap by time
        self.time_ns: Callable[[], int] = partial(getattr, self, "now_ns")     # read often, so no Python frame

    def next_ns(self) -> int:
        """Return the time of the next event, `NEVER_NS` if there is none."""
        return int(self.queue[0][0]) if self.queue else NEVER_NS

    def move_to(self, time_ns: int) -> None:
        """Set the time to `time_ns`, before which every event has run."""
        assert self.now_ns <= time_ns, f"{time_ns} ns lies before {self.now_ns} ns"
        self.now_ns = time_ns


    def hold_until(self, time_ns: int) -> None:
        """Move every event before `time_ns` to that instant, in their order."""
        held = sorted(entry for entry in self.queue if entry[0] < time_ns)
        self.queue[:] = [(time_ns, NORMAL, next(self._eid), event) for *_, event in held] + \
                        [entry for entry in self.queue if entry[0] >= time_ns]
        heapify(self.queue)


# No methods, as compiled code calls a function without a look-up.

def call_in(env: NodeEnvironment, delay_ns: int, action: Callable[[Any], None]) -> None:
    """Call `action` after `delay_ns`, in the order of scheduling among the events of that instant."""
    heappush(env.queue, (env.now_ns + delay_ns, NORMAL, next(env._eid), Alarm(action)))


def timeout_in(env: NodeEnvironment, delay_ns: int) -> Timeout:
    """Return `env.timeout(delay_ns)` for delay_ns >= 0, made without a frame of Python."""
    timeout = Timeout.__new__(Timeout)
    timeout.env = env
    timeout.callbacks = []
    timeout._value, timeout._delay, timeout._ok = None, delay_ns, True
    heappush(env.queue, (env.now_ns + delay_ns, NORMAL, next(env._eid), timeout))
    return timeout


def run_before(limit_ns: int, env: NodeEnvironment) -> None:
    """Run every event before `limit_ns`; RuntimeError for too many at one instant."""
    queue = env.queue
    instant_ns, events = -1, 0
    while queue and (time_ns := queue[0][0]) < limit_ns:
        if time_ns != instant_ns:
            instant_ns, events = time_ns, 0
        events += 1
        if events > MAX_EVENTS_AT_ONE_INSTANT:
            raise RuntimeError(f"{events - 1} events at {time_ns} ns: the program waits for no time to pass")
        event = queue[0][3]
        if not event._ok:
            env.step()                      # SimPy raises a failure that no process has caught
            continue
        heappop(queue)                      # as `step` does for any other event
        env.now_ns = time_ns
        callbacks, event.callbacks = event.callbacks, None
        for callback in callbacks:
            callback(event)
