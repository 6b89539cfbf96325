"""The frames by which a UGV captures a target, 4 bytes: 0xC1, kind, number of the target, number of the sensor.

    UGV     'G'    grips the target, which it sees within the capture distance
    target  'H'    is held by that sensor: the answer to the first grip, and to each later one

The target answers, so of two UGVs in range exactly one captures it.
Parsing never raises: it returns None for a frame that is none of these.
"""

from __future__ import annotations

from enum import Enum
from struct import Struct
from typing import Final, NamedTuple

MAGIC: Final = 0xC1
_FRAME: Final = Struct("<BcBB")


class Grip(Enum):
    GRIPS = b"G"
    HELD = b"H"


class GripFrame(NamedTuple):
    kind: Grip
    target: int
    sensor: int


def pack(frame: GripFrame) -> bytes:
    return _FRAME.pack(MAGIC, frame.kind.value, frame.target, frame.sensor)


def unpack(data: bytes) -> GripFrame | None:
    if len(data) != _FRAME.size:
        return None
    magic, kind, target, sensor = _FRAME.unpack(data)
    if magic != MAGIC or kind not in (Grip.GRIPS.value, Grip.HELD.value):
        return None
    return GripFrame(Grip(kind), target, sensor)
