"""CAN frames as captures hold them, link type 227 (CAN_SOCKETCAN), and back to the bytes of a `can` port.

    can_id u32, big endian | len u8 | flags u8 | reserved u8 | len8_dlc u8 | data, `len` bytes

Flags and identifier bits are those of frame.py; of a frame of CAN FD the flag FDF is set. An error frame is SocketCAN's
message about an error of the bus: ERR, classes PROT and BUSERROR, 8 bytes of zeros.

Source: tcpdump.org, LINKTYPE_CAN_SOCKETCAN; include/uapi/linux/can/error.h.
"""

from __future__ import annotations

from struct import Struct
from typing import Final

from netem.media.can.frame import (
    CLASSICAL_BYTES,
    ERROR_FLAG,
    EXTENDED_FLAG,
    FD_BYTES,
    FD_FORMAT,
    REMOTE_FLAG,
    MalformedFrame,
    unpack,
)

LINK_TYPE: Final = 227
_OF_PORT = Struct("<IBBBB")
_CAPTURED = Struct(">IBBBB")
_PROTOCOL, _BUS_ERROR = 0x8, 0x80           # CAN_ERR_PROT, CAN_ERR_BUSERROR
ERROR_FRAME: Final = _CAPTURED.pack(ERROR_FLAG | _PROTOCOL | _BUS_ERROR, 8, 0, 0, 0) + bytes(8)


def captured(data: bytes) -> bytes:
    """Return the packet of a frame as a `can` port has it; of b"", that of an error frame."""
    if not data:
        return ERROR_FRAME
    can_id, length, flags, reserved, len8_dlc = _OF_PORT.unpack_from(data)
    head = _CAPTURED.pack(can_id, length, flags, reserved, len8_dlc)
    return head if can_id & REMOTE_FLAG else head + data[_OF_PORT.size:_OF_PORT.size + length]


def offered(packet: bytes) -> bytes | None:
    """Return the frame of a packet as a `can` port takes it, None for a message about an error.

    Raises `MalformedFrame`.
    """
    if len(packet) < _CAPTURED.size:
        raise MalformedFrame(f"{len(packet)} bytes, expected at least {_CAPTURED.size}")
    can_id, length, flags, _, len8_dlc = _CAPTURED.unpack_from(packet)
    if can_id & ERROR_FLAG:
        return None
    fd = flags & FD_FORMAT or len(packet) == FD_BYTES
    payload = packet[_CAPTURED.size:]
    if len(payload) < (0 if can_id & REMOTE_FLAG else length):
        raise MalformedFrame(f"{len(payload)} bytes of data, expected {length}")
    if length > (64 if fd else 8):
        raise MalformedFrame(f"length {length}, at most {64 if fd else 8}")
    if not can_id & EXTENDED_FLAG:
        can_id &= REMOTE_FLAG | 0x7FF
    head = _OF_PORT.pack(can_id, length, (flags | FD_FORMAT) if fd else 0, 0, 0 if fd else len8_dlc)
    data = (head + payload[:length]).ljust(FD_BYTES if fd else CLASSICAL_BYTES, b"\0")
    unpack(data)
    return data
