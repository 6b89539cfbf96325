"""What a robot's program gets: its node, its local clock, its plant, what it knows of the team, its own randomness.

A program reads only `board.now_ns` (local time) and waits with `yield board.until(local_ns)`. The timer is armed with
the clock as it runs at that moment, as in a microcontroller: an adjustment while it waits does not move it. After a
step back the program wakes before `local_ns`; `yield from board.wait_until(local_ns)` then waits on. After a step
forward it wakes late, by the step. Schedules are asked from the local time after waking, so both heal by themselves.

A promise of silence is true time. One that was given before a correction of the clock may then lie behind the next
slot: correct first and promise afterwards, or promise less by the correction's bound. Steps by fault are known to the
board (not to the program), and no promise reaches beyond the next one.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from random import Random
from typing import Any, Final

from simpy.events import Event, Timeout

from firmware_sim.local_clock import LocalClock
from fmus.plant import Plant
from netem.node.node import Node

MAX_WAITS_AT_ONE_INSTANT: Final = 100_000


@dataclass
class Board:
    node: Node
    clock: LocalClock
    plant: Plant | None
    team: Mapping[str, Any]
    rng: Random
    clock_steps: Sequence[tuple[int, int]] = ()     # faults: (true_ns, delta_ns), in order

    def __post_init__(self) -> None:
        instants = [true_ns for true_ns, _ in self.clock_steps]
        if any(true_ns < self.node.now_ns for true_ns in instants) or instants != sorted(instants):
            raise ValueError(f"{self.node.name}: clock_steps at {instants} ns: expected instants from now on, in order")
        self._steps_ahead = list(self.clock_steps)
        self._waits_over, self._waited_at_ns = 0, -1
        if self._steps_ahead:
            self.node.env.process(self._step_clock())

    @property
    def now_ns(self) -> int:
        """Local time."""
        return self.clock.now_ns()

    def until(self, local_ns: int) -> Timeout:
        """Event at the first true instant at which the clock, as it runs now, reads `local_ns`; or at once."""
        env = self.node.env
        return Timeout(env, max(0, self.clock.true_at(local_ns) - env.time_ns()))

    def wait_until(self, local_ns: int) -> Generator[Event, Any, None]:
        """`yield from` this: come back when the clock reads at least `local_ns`, whatever is done to it meanwhile."""
        if self.clock.now_ns() >= local_ns:
            self._note_wait_that_is_over(local_ns)
            return
        yield self.until(local_ns)
        while self.clock.now_ns() < local_ns:
            yield self.until(local_ns)

    def silent_until(self, local_ns: int) -> None:
        """Firm promise: this node hands out nothing before local time `local_ns`, as the clock runs now."""
        self._promise(self.clock.true_at(local_ns))

    def silent_unless_heard_until(self, local_ns: int) -> None:
        """Promise that no event of this node before local time `local_ns` hands anything out, until it hears something.

        A port with `answers = False` does not count as hearing.
        """
        true_ns = self.clock.true_at(local_ns)
        self.node.silent_unless_heard_until(min(true_ns, self._steps_ahead[0][0]) if self._steps_ahead else true_ns)

    def sleep_until(self, local_ns: int) -> Timeout:
        """`silent_until` and `until` in one: what a program does that knows when it acts next."""
        true_ns = self.clock.true_at(local_ns)
        node = self.node
        if self._steps_ahead:
            self._promise(true_ns)
        else:
            node.silent_until(true_ns)
        env = node.env
        return Timeout(env, max(0, true_ns - env.time_ns()))

    def _note_wait_that_is_over(self, local_ns: int) -> None:
        """RuntimeError for a program that waits again and again for instants that have passed: it would never end."""
        now_ns = self.node.env.time_ns()
        self._waits_over = self._waits_over + 1 if now_ns == self._waited_at_ns else 1
        self._waited_at_ns = now_ns
        if self._waits_over > MAX_WAITS_AT_ONE_INSTANT:
            raise RuntimeError(f"{MAX_WAITS_AT_ONE_INSTANT} waits in a row at {now_ns} ns for instants that had passed"
                               f", the last for {local_ns} ns of local time: no robot time passes; wait for later "
                               "ones, as with a period of more than 0")

    def _promise(self, true_ns: int) -> None:
        if self._steps_ahead:
            true_ns = min(true_ns, self._steps_ahead[0][0])
        self.node.silent_until(true_ns)

    def _step_clock(self) -> Generator[Event, Any, None]:
        env = self.node.env
        while self._steps_ahead:
            true_ns, delta_ns = self._steps_ahead[0]
            yield env.timeout(true_ns - env.now)
            self.clock.step(delta_ns)
            del self._steps_ahead[0]
            self.node.event("clock step", f"{delta_ns} ns")
