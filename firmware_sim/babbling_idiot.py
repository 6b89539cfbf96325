"""A node that floods its CAN bus: a babbling idiot, the fault that arbitration by priority cannot contain.

It sends more frames of one identifier than the bus can carry, over some time; identifiers above its own starve. Source
of the name: Temple 1998, "Avoiding the babbling-idiot failure in a time-triggered communication system", FTCS-28.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any

from simpy.events import Event

from firmware_sim.board import Board
from netem.media.can.frame import CanFrame, pack


@dataclass(frozen=True)
class BabblerSettings:
    """A frame every `period_ns` on [from_ns, until_ns) of the local clock, `length` bytes of 0x55."""

    from_ns: int
    until_ns: int
    period_ns: int
    can_id: int = 0             # of 11 bits
    length: int = 8             # bytes, 0 to 8

    def __post_init__(self) -> None:
        if not 0 <= self.from_ns < self.until_ns or self.period_ns < 1:
            raise ValueError(f"from_ns={self.from_ns}, until_ns={self.until_ns}, period_ns={self.period_ns}: expected "
                             "0 <= from < until and a period of at least 1 ns")
        if not 0 <= self.can_id <= 0x7FF or not 0 <= self.length <= 8:
            raise ValueError(f"can_id={self.can_id}, length={self.length}: expected an identifier of 11 bits and 0 to "
                             "8 bytes")


class BabblingIdiot:
    Settings = BabblerSettings

    def __init__(self, board: Board, settings: BabblerSettings) -> None:
        self._board, self._settings = board, settings
        self._frame = pack(CanFrame(settings.can_id, b"\x55" * settings.length))
        self._port = board.port("can", listen_only=True)

    def run(self) -> Generator[Event, Any, None]:
        settings = self._settings
        for at_ns in range(settings.from_ns, settings.until_ns, settings.period_ns):
            yield from self._board.sleep_until(at_ns)
            self._port.send(self._frame)
