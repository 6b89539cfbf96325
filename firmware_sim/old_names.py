"""Former names of a board's attributes: each fails with what a program writes today."""

from __future__ import annotations

from typing import Final

BOARD: Final = {
    "node": "board.port(name), board.count, board.record, board.event and board.warn do what programs asked it for",
    "plant": "board.sense(name), board.actuate(name, value), or board.sensors(names) and board.actuators(names)",
    "clock": "board.now_ns is what the clock shows; board.adjust_clock sets it",
    "wait_until": "yield from board.sleep_until(local_ns)",
    "silent_until": "board.at, every and sleep_until promise silence by themselves; board.promise_firm gives more",
    "silent_unless_heard_until": "board.at, every and sleep_until promise silence by themselves; board.promise_soft "
                                 "gives more",
}


class OldName:
    """A class attribute that raises AttributeError when it is read from an instance.

    It is no `__getattr__`: compiled, that would also be called when a property raises, and hide the property's error.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, board: object, cls: type | None = None) -> OldName:
        if board is None:
            return self
        raise AttributeError(f"Board has no {self._name!r} any more: {BOARD[self._name]}")
