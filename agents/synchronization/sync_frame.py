"""The frame in which a robot broadcasts its output: magic, sender, slot number, then one float64 per output.

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

    __slots__ = ("outputs", "sender", "slot")

    def __init__(self, sender: int, slot: int, outputs: tuple[float, ...]) -> None:
        self.sender = sender
        self.slot = slot
        self.outputs = outputs


class SyncFrameCodec:
    """Packs and unpacks the frames of a team of `robots` robots with `outputs` values each."""

    def __init__(self, robots: int, outputs: int) -> None:
        if not 1 <= robots <= MAX_ROBOTS:
            raise ValueError(f"{robots} robots: a sync frame names 1 to {MAX_ROBOTS}")
        self._robots = robots
        self._values = struct.Struct(f"<BBI{outputs}d")
        self._size, self._unpack = self._values.size, self._values.unpack

    @property
    def size_bytes(self) -> int:
        return self._values.size

    def pack(self, sender: int, slot: int, outputs: Sequence[float]) -> bytes:
        return self._values.pack(MAGIC, sender, slot & 0xFFFFFFFF, *outputs)

    def unpack(self, data: bytes) -> SyncFrame | None:
        if len(data) != self._size:
            return None
        values: tuple[Any, ...] = self._unpack(data)
        magic, sender, slot = values[0], values[1], values[2]
        outputs = values[3:]
        if magic != MAGIC or sender >= self._robots:
            return None
        for value in outputs:
            if not isfinite(value):
                return None
        return SyncFrame(sender, slot, outputs)
