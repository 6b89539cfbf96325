"""The bytes of a `can` port, both directions: SocketCAN's `can_frame` (16 bytes) and `canfd_frame` (72 bytes).

    can_id u32 | len u8 | flags u8 | reserved u8 | len8_dlc u8 | data, 8 or 64 bytes            all little endian
    can_id: identifier, EFF 0x80000000 (29 bits), RTR 0x40000000 (remote), ERR 0x20000000 (message about an error)
    flags, of a canfd_frame: BRS 1, ESI 2, FDF 4          len8_dlc, of a can_frame with 8 bytes: a DLC of 9 to 15, or 0

Source: include/uapi/linux/can.h. The two structs differ in size. `pack` pads a CAN FD payload with zeros to the next
length that a DLC can name, as Linux does; bytes beyond the payload are zeros.

Not modelled: CAN XL.
"""

from __future__ import annotations

from struct import Struct
from typing import Final, NamedTuple

EXTENDED_FLAG: Final = 0x80000000
REMOTE_FLAG: Final = 0x40000000
ERROR_FLAG: Final = 0x20000000
STANDARD_MASK: Final = 0x7FF
EXTENDED_MASK: Final = 0x1FFFFFFF

BIT_RATE_SWITCH: Final = 1
ERROR_STATE: Final = 2
FD_FORMAT: Final = 4

CLASSICAL_BYTES: Final = 16
FD_BYTES: Final = 72
FD_LENGTHS: Final = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)     # by DLC

_CLASSICAL = Struct("<IBBBB8s")
_FD = Struct("<IBBBB64s")
_DLC_OF = {length: dlc for dlc, length in enumerate(FD_LENGTHS)}


class MalformedFrame(ValueError):
    """Bytes or values that are no CAN frame."""


class CanFrame(NamedTuple):
    """One frame as programs use it.

    `dlc` is the data length code on the wire, 0..15, or -1 for the one that `data` needs. A remote frame has no data;
    its `dlc` is that of the data it requests. `error` marks a message of the node's own controller about an error.
    """

    can_id: int
    data: bytes = b""
    extended: bool = False
    remote: bool = False
    fd: bool = False
    bit_rate_switch: bool = False
    error_state: bool = False
    dlc: int = -1
    error: bool = False


def is_error(data: bytes) -> bool:
    """Return whether a struct is a message about an error; False for bytes that are no struct."""
    return len(data) in (CLASSICAL_BYTES, FD_BYTES) and bool(int.from_bytes(data[:4], "little") & ERROR_FLAG)


def fd_length(length: int) -> int:
    """Shortest data length of CAN FD that holds `length` bytes; raises `MalformedFrame` above 64."""
    if not 0 <= length <= 64:
        raise MalformedFrame(f"data of {length} bytes: CAN FD carries at most 64")
    return next(known for known in FD_LENGTHS if known >= length)


def pack(frame: CanFrame) -> bytes:
    """Return the struct to send on a port; raises `MalformedFrame`."""
    can_id, data, extended, remote, fd, switch, error_state, dlc, error = frame
    if not 0 <= can_id <= (EXTENDED_MASK if extended or error else STANDARD_MASK):
        raise MalformedFrame(f"can_id={can_id:#x}: expected {29 if extended or error else 11} bits"
                             + ("" if extended or error else "; set extended for 29"))
    if remote and (fd or data):
        raise MalformedFrame("a remote frame has no data and exists in classical CAN only")
    can_id |= EXTENDED_FLAG * extended | REMOTE_FLAG * remote | ERROR_FLAG * error
    if fd:
        length = fd_length(len(data))
        if dlc not in (-1, _DLC_OF[length]):
            raise MalformedFrame(f"dlc={dlc}: {len(data)} bytes of CAN FD need {_DLC_OF[length]}")
        return _FD.pack(can_id, length, FD_FORMAT | BIT_RATE_SWITCH * switch | ERROR_STATE * error_state, 0, 0, data)
    if len(data) > 8:
        raise MalformedFrame(f"data of {len(data)} bytes: classical CAN carries at most 8; set fd for more")
    if dlc == -1:
        dlc = len(data)
    if not 0 <= dlc <= 15 or not (remote or len(data) == min(dlc, 8)):
        raise MalformedFrame(f"dlc={dlc}: {len(data)} bytes of data do not fit it")
    return _CLASSICAL.pack(can_id, min(dlc, 8), 0, 0, dlc if dlc > 8 else 0, data)


def unpack(data: bytes) -> CanFrame:
    """Return the frame in a struct; raises `MalformedFrame`, whose text is short enough for a ledger."""
    if len(data) == CLASSICAL_BYTES:
        can_id, length, _, _, len8_dlc, payload = _CLASSICAL.unpack(data)
        if length > 8:
            raise MalformedFrame(f"length {length}, at most 8")
        fd, flags, dlc = False, 0, len8_dlc if length == 8 and 9 <= len8_dlc <= 15 else length
    elif len(data) == FD_BYTES:
        can_id, length, flags, _, _, payload = _FD.unpack(data)
        fd, dlc = True, _DLC_OF.get(length, -1)
        if dlc < 0:
            raise MalformedFrame(f"length {length}, which no DLC of CAN FD names")
    else:
        raise MalformedFrame(f"{len(data)} bytes, expected {CLASSICAL_BYTES} or {FD_BYTES}, as pack makes them")
    extended, remote, error = bool(can_id & EXTENDED_FLAG), bool(can_id & REMOTE_FLAG), bool(can_id & ERROR_FLAG)
    identifier = can_id & EXTENDED_MASK
    if identifier > STANDARD_MASK and not (extended or error):
        raise MalformedFrame(f"identifier {identifier:#x} without the EFF flag, at most 0x7ff")
    if remote and fd:
        raise MalformedFrame("remote frame of CAN FD")
    return CanFrame(identifier, b"" if remote else payload[:length], extended, remote, fd,
                    bool(flags & BIT_RATE_SWITCH), bool(flags & ERROR_STATE), dlc, error)
