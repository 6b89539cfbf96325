"""Warns that a firmware handed its board a frame longer than the port's FIFO holds, and that it was not sent."""

from __future__ import annotations

from typing import Final

from firmware_sim.board import Board
from netem.wire.level import Level

MOST_BYTES: Final = 2048            # BOARD_MAX_FRAME_BYTES of marconet_board.h, FRAME_BYTES of the emulated Cortex-M


def tell_frame_too_long(board: Board, port: str, length: int) -> None:
    """Record that `length` bytes were to be sent at a port, and were not."""
    board.event("frame not sent", f"{length} bytes at port {port!r}: its FIFO of {MOST_BYTES} bytes held fewer, or had "
                                  "overflowed: send less, or check what board_send returns, or TX_OVERFLOW",
                Level.ERROR)
