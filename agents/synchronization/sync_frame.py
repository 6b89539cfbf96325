"""The frame in which a robot broadcasts its output or state: magic, sender, slot number, then one float64 per value.

Parsing never raises: it returns None for a frame that is cut, too long, not finite or from an unknown sender.
Not modelled: a checksum; the radio has one.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from math import isfinite
from typing import Any, Final

MAGIC: Final = 0xD5
MAX_ROBOTS: Final = 255


class SyncFrame:
    """The content of a frame; `slot` is the number of the sender's slot in its schedule."""

    __slots__ = ("sender", "slot", "values")

    def __init__(self, sender: int, slot: int, values: tuple[float, ...]) -> None:
        self.sender = sender
        self.slot = slot
        self.values = values


class SyncFrameCodec:
    """Packs and unpacks the frames of a team of `robots` robots with `count` values each."""

    def __init__(self, robots: int, count: int) -> None:
        if not 1 <= robots <= MAX_ROBOTS:
            raise ValueError(f"{robots} robots: a sync frame names 1 to {MAX_ROBOTS}")
        self._robots = robots
        self._values = struct.Struct(f"<BBI{count}d")
        self._size, self._unpack = self._values.size, self._values.unpack

    @property
    def size_bytes(self) -> int:
        return self._values.size

    def pack(self, sender: int, slot: int, values: Sequence[float]) -> bytes:
        return self._values.pack(MAGIC, sender, slot & 0xFFFFFFFF, *values)

    def unpack(self, data: bytes) -> SyncFrame | None:
        if len(data) != self._size:
            return None
        fields: tuple[Any, ...] = self._unpack(data)
        magic, sender, slot = fields[0], fields[1], fields[2]
        values = fields[3:]
        if magic != MAGIC or sender >= self._robots:
            return None
        for value in values:
            if not isfinite(value):
                return None
        return SyncFrame(sender, slot, values)
