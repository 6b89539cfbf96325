"""Timers on a robot's clock, and the promise of silence that follows from them.

*Invariants*
- `_silences` holds for each armed timer the true instant [ns] before which it leads to no frame, except for the
  timers that were armed before a fault changed the clock: those are in `_earlier`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from simpy.events import Event, Process, Timeout

from firmware_sim.local_clock import LocalClock
from netem.node.environment import NodeEnvironment, call_in, timeout_in
from netem.node.node import Node
from netem.wire.instants import NEVER_NS


class Timers:
    """All timers of one board."""

    def __init__(self, node: Node, clock: LocalClock) -> None:
        self._env, self._clock = node.env, clock
        self._silences: list[int] = []
        self._earlier: list[tuple[int, int]] = []       # (the instant noted, that which holds since the fault)

    def call_at(self, local_ns: int, action: Callable[[Any], None]) -> int:
        """Call `action` when the clock, with its present rate and offset, reads `local_ns`; return the true instant."""
        env = self._env
        now_ns: int = env.now_ns
        true_ns = self._clock.true_at(local_ns)
        if true_ns < now_ns:
            true_ns = now_ns
        call_in(env, true_ns - now_ns, action)
        return true_ns

    def reached(self, local_ns: int) -> bool:
        """Return whether the clock reads at least `local_ns`."""
        return self._clock.now_ns() >= local_ns

    def now_ns(self) -> int:
        """Local time."""
        return self._clock.now_ns()

    def until(self, local_ns: int, silent_until_ns: int | None) -> Timeout:
        """Return a SimPy event at which the clock, with its present rate and offset, reads `local_ns`.

        It leads to no frame before `silent_until_ns`; None: not before it occurs.
        """
        env, clock = self._env, self._clock
        true_ns = clock.true_at(local_ns)
        now_ns: int = env.now_ns
        timeout = timeout_in(env, true_ns - now_ns if true_ns > now_ns else 0)
        if silent_until_ns is None:
            silent_ns = true_ns
        elif silent_until_ns >= NEVER_NS:
            return timeout
        else:
            silent_ns = clock.true_at(silent_until_ns)
        self._silences.append(silent_ns)
        callbacks = timeout.callbacks
        assert callbacks is not None
        callbacks.append(partial(self._over, silent_ns))
        return timeout

    def after(self, delay_ns: int, action: Callable[[], object], sends: bool) -> None:
        """Call `action` after `delay_ns` of true time."""
        Delay(self, self._env.now_ns + delay_ns, action, sends).start(self._env, delay_ns)

    def note_start(self, process: Process) -> None:
        """Note that `process` begins at the present instant, or when a pause that begins now is over."""
        now_ns: int = self._env.now_ns
        begins = process.target.callbacks
        assert begins is not None
        self.note_silence(now_ns)
        begins.append(partial(self._over, now_ns))

    def note_silence(self, true_ns: int) -> None:
        """Note that a timer was armed which leads to no frame before `true_ns`."""
        self._silences.append(true_ns)

    def withdraw_silence(self, true_ns: int) -> None:
        """Note that a timer armed with `note_silence(true_ns)` rang or was cancelled."""
        if self._earlier:
            for index, (noted_ns, _) in enumerate(self._earlier):
                if noted_ns == true_ns:
                    del self._earlier[index]
                    return
        self._silences.remove(true_ns)

    def change_clock(self, change: Callable[[], object]) -> None:
        """Change the clock by a fault, of which the program does not know: `change()` does so.

        The program may reach the local time until which it is silent earlier than it seemed, so the promise shrinks.
        Timers ring when they were going to.
        """
        now_ns: int = self._env.now_ns
        noted = [*self._earlier, *((silent_ns, silent_ns) for silent_ns in self._silences)]
        readings = [self._clock.reading_at(silent_ns) for _, silent_ns in noted]
        change()
        self._earlier = [(noted_ns, min(silent_ns, max(now_ns, self._clock.true_at(reading))))
                         for (noted_ns, silent_ns), reading in zip(noted, readings, strict=True)]
        self._silences.clear()

    def next_frame_ns(self) -> int:
        """Return the true instant [ns] before which no armed timer leads to a frame."""
        silences = self._silences
        first_ns = NEVER_NS
        for silent_ns in silences:
            if silent_ns < first_ns:
                first_ns = silent_ns
        if self._earlier:
            first_ns = min(first_ns, min(silent_ns for _, silent_ns in self._earlier))
        return first_ns

    def _over(self, true_ns: int, event: Event) -> None:
        self.withdraw_silence(true_ns)


class Delay:
    """An action after a delay of true time; it cannot be withdrawn."""

    __slots__ = ("_action", "_sends", "_timers", "_true_ns")

    def __init__(self, timers: Timers, true_ns: int, action: Callable[[], object], sends: bool) -> None:
        self._timers, self._true_ns, self._action, self._sends = timers, true_ns, action, sends

    def start(self, env: NodeEnvironment, delay_ns: int) -> None:
        """Arm it."""
        if self._sends:
            self._timers.note_silence(self._true_ns)
        call_in(env, delay_ns, self._ring)

    def _ring(self, event: object) -> None:
        if self._sends:
            self._timers.withdraw_silence(self._true_ns)
        self._action()


class Timer:
    """Calls its action once, when the clock reads at least `local_ns`; `cancel` withdraws it."""

    __slots__ = ("_action", "_armed_ns", "_over", "_sends", "_timers", "local_ns")

    def __init__(self, timers: Timers, local_ns: int, action: Callable[[], object], sends: bool) -> None:
        self.local_ns = local_ns
        self._timers, self._action, self._sends = timers, action, sends
        self._armed_ns = 0              # true time for which it is armed
        self._over = False
        self._arm()

    def cancel(self) -> None:
        """Withdraw the action if it has not been called yet."""
        if not self._over:
            self._over = True
            if self._sends:
                self._timers.withdraw_silence(self._armed_ns)

    def _arm(self) -> None:
        self._armed_ns = self._timers.call_at(self.local_ns, self._ring)
        if self._sends:
            self._timers.note_silence(self._armed_ns)

    def _ring(self, event: object) -> None:
        if self._over:
            return
        if self._sends:
            self._timers.withdraw_silence(self._armed_ns)
        if not self._timers.reached(self.local_ns):      # the clock was set back meanwhile
            self._arm()
            return
        self._over = True
        self._action()


class Repetition:
    """Calls its action at offset, offset + period, ... of the local clock; the k-th instant is computed from k."""

    __slots__ = ("_action", "_k", "_offset_ns", "_period_ns", "_sends", "_timer", "_timers")

    def __init__(self, timers: Timers, period_ns: int, action: Callable[[], object], offset_ns: int,
                 sends: bool) -> None:
        if period_ns < 1:
            raise ValueError(f"period_ns={period_ns}: expected at least 1")
        if offset_ns < 0:
            raise ValueError(f"offset_ns={offset_ns}: expected 0 or more")
        self._timers, self._action, self._sends = timers, action, sends
        self._period_ns, self._offset_ns = period_ns, offset_ns
        self._k = max(0, -((offset_ns - timers.now_ns()) // period_ns))     # index of the first instant not before now
        self._timer = self._next()

    def cancel(self) -> None:
        """Stop the repetition."""
        self._timer.cancel()

    def _next(self) -> Timer:
        return Timer(self._timers, self._offset_ns + self._k * self._period_ns, self._act, self._sends)

    def _act(self) -> None:
        self._k += 1
        self._timer = self._next()
        self._action()
