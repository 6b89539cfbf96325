"""The messages of a sensing medium, all little endian.

    observer -> medium    'L'                                   look at the next exposure
    medium -> observer    'D'  exposure [ns], x, y, z [m], name of the body in UTF-8
    medium -> observer    'N'  exposure [ns]                    no body was in view
"""

from __future__ import annotations

from struct import Struct
from typing import Final, NamedTuple

LOOK: Final = b"L"
_DETECTION, _NOTHING = Struct("<cq3d"), Struct("<cq")


class Body(NamedTuple):
    """Pose of a body; the heading counts from the x axis towards the y axis."""

    x_m: float
    y_m: float
    z_m: float
    heading_rad: float


class Detection(NamedTuple):
    exposed_ns: int
    x_m: float
    y_m: float
    z_m: float
    name: str


class NothingSeen(NamedTuple):
    exposed_ns: int


def pack_detection(detection: Detection) -> bytes:
    return _DETECTION.pack(b"D", *detection[:4]) + detection.name.encode()


def pack_nothing(exposed_ns: int) -> bytes:
    return _NOTHING.pack(b"N", exposed_ns)


def unpack_sight(data: bytes) -> Detection | NothingSeen | None:
    """Read a message to an observer; None if it is malformed."""
    if data[:1] == b"N" and len(data) == _NOTHING.size:
        return NothingSeen(_NOTHING.unpack(data)[1])
    if data[:1] != b"D" or len(data) < _DETECTION.size:
        return None
    _, exposed_ns, x_m, y_m, z_m = _DETECTION.unpack_from(data)
    try:
        return Detection(exposed_ns, x_m, y_m, z_m, data[_DETECTION.size:].decode())
    except UnicodeDecodeError:
        return None
