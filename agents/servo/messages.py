"""The frames of a servo: one number in 4 bytes, a float of single precision, little endian."""

from __future__ import annotations

from struct import Struct

from netem.media.can.frame import STANDARD_MASK, CanFrame, pack, unpack

_NUMBER = Struct("<f")


def pack_number(can_id: int, number: float) -> bytes:
    """Return the frame; raises OverflowError for a number beyond single precision."""
    return pack(CanFrame(can_id, _NUMBER.pack(number)))


def number_in(data: bytes, can_id: int) -> float | None:
    """Return the number of a frame with the identifier `can_id`; None for any other frame."""
    frame = unpack(data)
    if frame.can_id != can_id or frame.extended or frame.remote or frame.error or len(frame.data) != _NUMBER.size:
        return None
    return float(_NUMBER.unpack(frame.data)[0])


def check_identifier(name: str, can_id: int) -> None:
    """Raise ValueError unless the identifier of the setting `name` has 11 bits."""
    if not 0 <= can_id <= STANDARD_MASK:
        raise ValueError(f"{name}={can_id:#x}: expected 11 bits")
