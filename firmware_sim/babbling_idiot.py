"""A node that floods its CAN bus: a babbling idiot, the fault that arbitration by priority cannot contain.

It hands out frames of one identifier, more than the bus can carry, from one instant to another; identifiers above its
own starve. Source of the name: Temple 1998, "Avoiding the babbling-idiot failure in a time-triggered communication
system", FTCS-28.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

from simpy.events import Event

from firmware_sim.board import Board
from netem.media.can.frame import CanFrame, pack


class BabblingIdiot:
    def __init__(self, board: Board, *, from_ns: int, until_ns: int, period_ns: int, can_id: int = 0,
                 length: int = 8) -> None:
        """A frame every `period_ns` on [from_ns, until_ns) of its local clock, `length` bytes of 0x55."""
        if not 0 <= from_ns < until_ns or period_ns < 1:
            raise ValueError(f"from_ns={from_ns}, until_ns={until_ns}, period_ns={period_ns}: expected 0 <= from < "
                             "until and a period of at least 1 ns")
        if not 0 <= can_id <= 0x7FF or not 0 <= length <= 8:
            raise ValueError(f"can_id={can_id}, length={length}: expected an identifier of 11 bits and 0 to 8 bytes")
        self._board = board
        self._from_ns, self._until_ns, self._period_ns = from_ns, until_ns, period_ns
        self._frame = pack(CanFrame(can_id, b"\x55" * length))
        self._port = board.node.ports["can"]
        self._port.answers = False

    def run(self) -> Generator[Event, Any, None]:
        board, at_ns = self._board, self._from_ns
        while at_ns < self._until_ns:
            yield board.sleep_until(at_ns)
            self._port.send(self._frame)
            at_ns += self._period_ns
