"""What a program has set itself to do, and the promise that follows: silence until then, unless it hears something.

Invariant: whatever the program hands out, it hands out within one of these actions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from simpy.events import Event

from firmware_sim.board import Board
from netem.wire.instants import NEVER_NS


@dataclass
class Speech:
    """Times are on the local clock."""

    board: Board
    _due: list[int] = field(default_factory=list)
    _acting: bool = field(default=False, init=False)

    def at(self, due_ns: int, action: Callable[[], None]) -> None:
        """Call `action` then; it may speak."""
        def act(_: Event) -> None:
            self._due.remove(due_ns)
            self._acting = True
            action()
            self._acting = False
            self.promise()
        timer = self.board.until(due_ns)
        assert timer.callbacks is not None
        timer.callbacks.append(act)
        self._due.append(due_ns)
        if not self._acting:
            self.promise()

    def every(self, period_ns: int, offset_ns: int, action: Callable[[], None], k: int = 0) -> None:
        """Call `action` at offset, offset + period, ..., from the k-th of these instants on."""
        def act() -> None:
            self.every(period_ns, offset_ns, action, k + 1)
            action()
        self.at(offset_ns + k * period_ns, act)

    def promise(self) -> None:
        """To be said again after what was heard asked for nothing."""
        self.board.silent_unless_heard_until(min(self._due, default=NEVER_NS))
