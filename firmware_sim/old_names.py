"""Former names of a board's and a port's attributes, with what a program writes today, for error messages."""

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

def renamed(name: str) -> str:
    """Return the text of the AttributeError for an attribute `name` that a board does not have."""
    if name in BOARD:
        return f"Board has no {name!r} any more: {BOARD[name]}"
    return f"Board has no {name!r}"
