"""The frame that a robot broadcasts in its slot: magic, sender, slot number, then float64 values.

With waves there are two values for each neighbour, by ascending number: the wave to it, and the energy sent to it so
far. With outputs there is one, y. Parsing never raises: it returns None for a frame that is cut, too long, from an
unknown sender, or has a value that is not finite or beyond LARGEST, whose square could be.
Not modelled: a checksum; the radio has one.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Final, NamedTuple

MAGIC: Final = 0xD6
MAX_ROBOTS: Final = 255
LARGEST: Final = 1e100
_HEAD: Final = struct.Struct("<BBI")


class WaveFrame(NamedTuple):
    sender: int
    slot: int
    values: tuple[float, ...]


class WaveFrameCodec:
    """`counts`: the number of values in the frames of each robot."""

    def __init__(self, counts: Sequence[int]) -> None:
        if not 1 <= len(counts) <= MAX_ROBOTS:
            raise ValueError(f"{len(counts)} robots: a wave frame names 1 to {MAX_ROBOTS}")
        self._values = [struct.Struct(f"<{count}d") for count in counts]

    def size_bytes(self, sender: int) -> int:
        return _HEAD.size + self._values[sender].size

    def pack(self, sender: int, slot: int, values: Sequence[float]) -> bytes:
        return _HEAD.pack(MAGIC, sender, slot & 0xFFFFFFFF) + self._values[sender].pack(*values)

    def unpack(self, data: bytes) -> WaveFrame | None:
        if len(data) < _HEAD.size:
            return None
        magic, sender, slot = _HEAD.unpack_from(data)
        if magic != MAGIC or sender >= len(self._values) or len(data) != self.size_bytes(sender):
            return None
        values = self._values[sender].unpack_from(data, _HEAD.size)
        return WaveFrame(sender, slot, values) if all(abs(value) <= LARGEST for value in values) else None
