"""The port on which robots look: the medium `radio`, which may be a CAN bus with CAN FD instead of a radio.

On a bus a request has the identifier 0x200 and an answer 0x201, at the data bit rate. CAN FD pads an answer of 43 bytes
to 48; the padding is taken off again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from firmware_sim.board import Board
from netem.media.can.frame import CanFrame, MalformedFrame, fd_length, pack, unpack

PORT: Final = "radio"
REQUEST_ID: Final = 0x200
ANSWER_ID: Final = 0x201


def can_struct(can_id: int, frame: bytes) -> bytes:
    """Return the CAN FD struct that carries a frame of a look."""
    return pack(CanFrame(can_id, frame, fd=True, bit_rate_switch=True))


class LookPort:
    """Sends and hears the frames of looks as they are on a radio; `heard_bytes` is the length of those heard."""

    def __init__(self, board: Board, can_id: int, heard_bytes: int, hear: Callable[[bytes], None]) -> None:
        self._can_id, self._heard_bytes, self._hear = can_id, heard_bytes, hear
        self._on_bus = PORT in board.can_buses
        self._port = board.port(PORT, self._hear_struct if self._on_bus else hear)

    def send(self, frame: bytes) -> None:
        self._port.send(can_struct(self._can_id, frame) if self._on_bus else frame)

    def _hear_struct(self, data: bytes) -> None:
        try:
            frame = unpack(data)
        except MalformedFrame:
            self._hear(b"")                     # counted as unreadable
            return
        padded = len(frame.data) == fd_length(self._heard_bytes)
        self._hear(frame.data[:self._heard_bytes] if padded else frame.data)
