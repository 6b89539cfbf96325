"""An action repeated at start, start + period, ... on the node's oscillator; the k-th instant is computed from k."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from firmware_sim.local_clock import LocalClock
from netem.node.node import Node
from netem.wire.instants import NEVER_NS


class Repeats(Protocol):
    """The part of a blocking program that `Repeating` uses."""

    node: Node
    oscillator: LocalClock
    repeating: list[Repeating]          # those that run

    def call_after(self, delay_ns: int, action: Callable[[], None]) -> None: ...


class Repeating:
    """Calls `action` at once, then every `period_ns`, within [start, start + duration_ns) if there is a duration."""

    def __init__(self, program: Repeats, period_ns: int, duration_ns: int | None,
                 action: Callable[[], None]) -> None:
        if period_ns < 1:
            raise ValueError(f"period of {period_ns} ns: expected at least 1 ns")
        self.next_ns = NEVER_NS         # true time of the next call
        self._program = program
        self._period_ns = period_ns
        self._duration_ns = duration_ns
        self._action = action
        self._start_ns = 0              # oscillator time of the start
        self._done = 0

    def start(self) -> None:
        """Start now, anew if it is running."""
        self.stop()
        self._start_ns, self._done = self._program.oscillator.now_ns(), 0
        self._program.repeating.append(self)
        self._act()

    @property
    def runs(self) -> bool:
        return self in self._program.repeating

    def stop(self) -> None:
        self.next_ns = NEVER_NS
        if self.runs:
            self._program.repeating.remove(self)

    def _act(self) -> None:
        self._done += 1
        after_ns = self._done * self._period_ns
        if self._duration_ns is None or after_ns < self._duration_ns:
            self.next_ns = self._program.oscillator.true_at(self._start_ns + after_ns)
            self._program.call_after(max(0, self.next_ns - self._program.node.now_ns), self._due)
        else:
            self.stop()
        self._action()

    def _due(self) -> None:
        if self.next_ns <= self._program.node.now_ns:       # False if it was stopped or started anew since
            self._act()
