"""The frames by which a UGV captures a target, little endian: 0xC1, kind, number of the target, number of the sensor.

    UGV     'G'    grips the target, which it sees within the capture distance, from its own place x, y [m]; 12 bytes
    target  'H'    is held by that sensor: the answer to the first grip within the capture distance, and to later ones

The target answers, so of two UGVs in range exactly one captures it; and it knows how far the gripper is, which a noisy
camera does not. Parsing never raises: it returns None for a frame that is none of these.
"""

from __future__ import annotations

from math import isfinite
from struct import Struct
from typing import Final, NamedTuple

MAGIC: Final = 0xC1
_GRIP: Final = Struct("<BcBBff")
_HELD: Final = Struct("<BcBB")


class Grip(NamedTuple):
    target: int
    sensor: int
    x_m: float                  # in single precision
    y_m: float


class Held(NamedTuple):
    target: int
    sensor: int


def pack(frame: Grip | Held) -> bytes:
    match frame:
        case Grip():
            return _GRIP.pack(MAGIC, b"G", *frame)
        case Held():
            return _HELD.pack(MAGIC, b"H", *frame)


def unpack(data: bytes) -> Grip | Held | None:
    if len(data) == _GRIP.size:
        magic, kind, target, sensor, x_m, y_m = _GRIP.unpack(data)
        if (magic, kind) == (MAGIC, b"G") and isfinite(x_m) and isfinite(y_m):
            return Grip(target, sensor, x_m, y_m)
    elif len(data) == _HELD.size:
        magic, kind, target, sensor = _HELD.unpack(data)
        if (magic, kind) == (MAGIC, b"H"):
            return Held(target, sensor)
    return None
