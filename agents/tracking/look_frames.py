"""The two frames of a look: the tracker sends a request, the reference answers with its pose and its inputs.

    request   magic, number of the look                                            3 bytes
    answer    magic, number of the look, x, y [m], theta [rad], v [m/s], omega [rad/s]      43 bytes

The reference sends an answer with the number `UNASKED`, without a request, when its inputs change.
Parsing never raises: it returns None for a frame that is cut, too long, or not finite.
"""

from __future__ import annotations

import struct
from math import isfinite
from typing import Final, NamedTuple

from agents.tracking.controller import Inputs, Pose

UNASKED: Final = 0xFFFF
_REQUEST: Final = struct.Struct("<BH")
_ANSWER: Final = struct.Struct("<BH5d")
REQUEST_BYTES: Final = _REQUEST.size
ANSWER_BYTES: Final = _ANSWER.size
_ASKS: Final = 0xA5
_ANSWERS: Final = 0xA6


class ReferenceState(NamedTuple):
    pose: Pose
    inputs: Inputs          # nominal


def pack_request(look: int) -> bytes:
    return _REQUEST.pack(_ASKS, look % UNASKED)


def unpack_request(data: bytes) -> int | None:
    """Return the number of the look; None if `data` is no request."""
    if len(data) != _REQUEST.size:
        return None
    magic, look = _REQUEST.unpack(data)
    return int(look) if magic == _ASKS else None


def pack_answer(look: int, state: ReferenceState) -> bytes:
    return _ANSWER.pack(_ANSWERS, look, *state.pose, *state.inputs)


def unpack_answer(data: bytes) -> tuple[int, ReferenceState] | None:
    """Return the number of the look answered, and the state; None if `data` is no answer."""
    if len(data) != _ANSWER.size:
        return None
    magic, look, *values = _ANSWER.unpack(data)
    if magic != _ANSWERS or not isfinite(sum(map(abs, values))):
        return None
    return look, ReferenceState(Pose(*values[:3]), Inputs(*values[3:]))
