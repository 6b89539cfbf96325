"""Timers on a robot's clock, and the promise of silence that follows from them.

*Invariants*
- `_silences` holds for each armed timer the true instant [ns] before which it leads to no frame.
- No promise extends beyond the next step of the clock by a fault, at which the program may change its plans.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from functools import partial
from typing import Any

from simpy.events import Event, Timeout

from firmware_sim.local_clock import LocalClock
from netem.node.environment import NodeEnvironment, call_in
from netem.node.node import Node
from netem.wire.instants import NEVER_NS


class Timers:
    """All timers of one board; each (true_ns, delta_ns) of `clock_steps` is a fault that sets the clock by delta_ns.

    Raises ValueError if the instants are out of order or over.
    """

    def __init__(self, node: Node, clock: LocalClock, clock_steps: Sequence[tuple[int, int]]) -> None:
        instants = [true_ns for true_ns, _ in clock_steps]
        if any(true_ns < node.now_ns for true_ns in instants) or instants != sorted(instants):
            raise ValueError(f"{node.name}: clock_steps at {instants} ns: expected instants from now on, in order")
        self._node, self._env, self.clock = node, node.env, clock
        self._steps_ahead = list(clock_steps)
        self.silences: list[int] = []   # for each armed timer the true instant before which it leads to no frame
        if self._steps_ahead:
            node.env.process(self._step_clock())

    def call_at(self, local_ns: int, action: Callable[[Any], None]) -> int:
        """Call `action` when the clock, with its present rate and offset, reads `local_ns`; return the true instant."""
        env = self._env
        now_ns: int = env.now_ns
        true_ns = self.clock.true_at(local_ns)
        if true_ns < now_ns:
            true_ns = now_ns
        call_in(env, true_ns - now_ns, action)
        return true_ns

    def until(self, local_ns: int, silent_until_ns: int | None) -> Timeout:
        """Return a SimPy event at which the clock, with its present rate and offset, reads `local_ns`.

        It leads to no frame before `silent_until_ns`; None: not before it occurs.
        """
        env, clock = self._env, self.clock
        true_ns = clock.true_at(local_ns)
        timeout = Timeout(env, max(0, true_ns - env.now_ns))
        if silent_until_ns is None:
            silent_ns = true_ns
        elif silent_until_ns >= NEVER_NS:
            return timeout
        else:
            silent_ns = clock.true_at(silent_until_ns)
        self.silences.append(silent_ns)
        callbacks = timeout.callbacks
        assert callbacks is not None
        callbacks.append(partial(self._over, silent_ns))
        return timeout

    def after(self, delay_ns: int, action: Callable[[], object], sends: bool) -> None:
        """Call `action` after `delay_ns` of true time."""
        Delay(self.silences, self._env.now_ns + delay_ns, action, sends).start(self._env, delay_ns)

    def next_frame_ns(self) -> int:
        """Return the true instant [ns] before which no armed timer leads to a frame."""
        silences = self.silences
        first_ns = NEVER_NS
        for silent_ns in silences:
            if silent_ns < first_ns:
                first_ns = silent_ns
        return self.no_later_than_a_step(first_ns) if self._steps_ahead else first_ns

    def no_later_than_a_step(self, true_ns: int) -> int:
        """Return `true_ns`, or the instant of the clock's next step by a fault if that is earlier."""
        return min(true_ns, self._steps_ahead[0][0]) if self._steps_ahead else true_ns

    def _over(self, true_ns: int, event: Event) -> None:
        self.silences.remove(true_ns)

    def _step_clock(self) -> Generator[Event, Any, None]:
        env = self._node.env
        while self._steps_ahead:
            true_ns, delta_ns = self._steps_ahead[0]
            yield env.timeout(true_ns - env.now)
            self.clock.adjust(delta_ns)
            del self._steps_ahead[0]
            self._node.event("clock step", f"{delta_ns} ns")


class Delay:
    """An action after a delay of true time; it cannot be withdrawn."""

    __slots__ = ("_action", "_sends", "_silences", "_true_ns")

    def __init__(self, silences: list[int], true_ns: int, action: Callable[[], object], sends: bool) -> None:
        self._silences, self._true_ns, self._action, self._sends = silences, true_ns, action, sends

    def start(self, env: NodeEnvironment, delay_ns: int) -> None:
        """Arm it."""
        if self._sends:
            self._silences.append(self._true_ns)
        call_in(env, delay_ns, self._ring)

    def _ring(self, event: object) -> None:
        if self._sends:
            self._silences.remove(self._true_ns)
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
                self._timers.silences.remove(self._armed_ns)

    def _arm(self) -> None:
        self._armed_ns = self._timers.call_at(self.local_ns, self._ring)
        if self._sends:
            self._timers.silences.append(self._armed_ns)

    def _ring(self, event: object) -> None:
        if self._over:
            return
        if self._sends:
            self._timers.silences.remove(self._armed_ns)
        if self._timers.clock.now_ns() < self.local_ns:       # the clock was set back meanwhile
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
        self._k = max(0, -((offset_ns - timers.clock.now_ns()) // period_ns))       # of the first instant not over
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
