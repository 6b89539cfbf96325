"""Timers of a board: an action at one instant of the local clock, or periodically."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from firmware_sim.board import Board


class Timer:
    """Calls its action once, when the clock reads at least `local_ns`; `cancel` withdraws it."""

    __slots__ = ("_action", "_armed_ns", "_board", "_over", "_sends", "local_ns")

    def __init__(self, board: Board, local_ns: int, action: Callable[[], object], sends: bool) -> None:
        self.local_ns = local_ns
        self._board, self._action, self._sends = board, action, sends
        self._armed_ns = 0              # true time for which it is armed
        self._over = False
        self._arm()

    def cancel(self) -> None:
        """Withdraw the action if it has not been called yet."""
        if not self._over:
            self._over = True
            if self._sends:
                self._board.withdraw_silence(self._armed_ns)

    def _arm(self) -> None:
        self._armed_ns = self._board.call_at(self.local_ns, self._ring)
        if self._sends:
            self._board.note_silence(self._armed_ns)

    def _ring(self, event: object) -> None:
        if self._over:
            return
        if self._sends:
            self._board.withdraw_silence(self._armed_ns)
        if self._board.now_ns < self.local_ns:          # the clock was set back meanwhile
            self._arm()
            return
        self._over = True
        self._action()


class Repetition:
    """Calls its action at offset, offset + period, ... of the local clock; the k-th instant is computed from k."""

    __slots__ = ("_action", "_board", "_k", "_offset_ns", "_period_ns", "_sends", "_timer")

    def __init__(self, board: Board, period_ns: int, action: Callable[[], object], offset_ns: int,
                 sends: bool) -> None:
        if period_ns < 1:
            raise ValueError(f"period_ns={period_ns}: expected at least 1")
        if offset_ns < 0:
            raise ValueError(f"offset_ns={offset_ns}: expected 0 or more")
        self._board, self._action, self._sends = board, action, sends
        self._period_ns, self._offset_ns = period_ns, offset_ns
        self._k = max(0, -((offset_ns - board.now_ns) // period_ns))      # index of the first instant not before now
        self._timer = self._next()

    def cancel(self) -> None:
        """Stop the repetition."""
        self._timer.cancel()

    def _next(self) -> Timer:
        return Timer(self._board, self._offset_ns + self._k * self._period_ns, self._act, self._sends)

    def _act(self) -> None:
        self._k += 1
        self._timer = self._next()
        self._action()
