"""The bus operations of FMI-LS-BUS 1.0 for CAN: decoder of Tx_Data, encoder of Rx_Data.

    operation    opcode u32 | length u32, of the whole operation | arguments                        all little endian
    0x01 Format Error       data length u16, data: the operation that was not understood
    0x10 CAN Transmit       id u32, ide u8, rtr u8, data length u16, data
    0x11 CAN FD Transmit    id u32, ide u8, brs u8, esi u8, data length u16, data
    0x12 CAN XL Transmit    not supported: answered by a Format Error
    0x20 Confirm            id u32
    0x30 Arbitration Lost   id u32
    0x31 Bus Error          id u32, error code u8, error flag u8, is sender u8
    0x40 Configuration      parameter u8, then a bit rate u32 [bit/s] or a behaviour u8
    0x41 Status             status u8
    0x42 Wakeup

A binary value holds any number of operations one after the other. `decode` yields each of them, and `Misshapen` for one
that breaks a rule; after a wrong length the rest of the value cannot be read, and is one misshapen operation.

Source: FMI-LS-BUS 1.0.0, sections 4.2 and 4.5.1; its header fmi3LsBusCan.h for the sizes where the text differs.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import IntEnum
from struct import Struct, error, unpack_from
from typing import Final, NamedTuple

from netem.media.can.frame import CanFrame, MalformedFrame, pack

FORMAT_ERROR: Final = 0x01
TRANSMIT: Final = 0x10
FD_TRANSMIT: Final = 0x11
XL_TRANSMIT: Final = 0x12
CONFIRM: Final = 0x20
ARBITRATION_LOST: Final = 0x30
BUS_ERROR: Final = 0x31
CONFIGURATION: Final = 0x40
STATUS: Final = 0x41
WAKEUP: Final = 0x42

HEADER: Final = Struct("<II")
_TRANSMIT: Final = Struct("<IIIBBH")
_FD_TRANSMIT: Final = Struct("<IIIBBBH")
_ID: Final = Struct("<III")
_BUS_ERROR: Final = Struct("<IIIBBB")
_FORMAT_ERROR: Final = Struct("<IIH")
MOST_DATA: Final = 0xFFFF       # bytes of the operation that a Format Error repeats


class Parameter(IntEnum):
    CAN_BAUDRATE = 1
    CAN_FD_BAUDRATE = 2
    CAN_XL_BAUDRATE = 3
    ARBITRATION_LOST_BEHAVIOR = 4


class Behavior(IntEnum):
    BUFFER_AND_RETRANSMIT = 1
    DISCARD_AND_NOTIFY = 2


class NodeStatus(IntEnum):
    ERROR_ACTIVE = 1
    ERROR_PASSIVE = 2
    BUS_OFF = 3


class Transmit(NamedTuple):
    frame: CanFrame


class Configuration(NamedTuple):
    parameter: Parameter
    value: int                  # bit/s, or a Behavior


class Status(NamedTuple):
    status: NodeStatus


class Wakeup(NamedTuple):
    pass


class FormatError(NamedTuple):
    data: bytes                 # the operation that the FMU did not understand


class Misshapen(NamedTuple):
    data: bytes                 # the operation, as it came
    why: str


Operation = Transmit | Configuration | Status | Wakeup | FormatError | Misshapen


def decode(value: bytes) -> Iterator[Operation]:
    """Yield the operations in a value of Tx_Data; raises nothing."""
    at = 0
    while at < len(value):
        rest = len(value) - at
        if rest < HEADER.size:
            yield Misshapen(value[at:], f"{rest} bytes: an operation has at least {HEADER.size}")
            return
        opcode, length = HEADER.unpack_from(value, at)
        if not HEADER.size <= length <= rest:
            yield Misshapen(value[at:], f"operation {opcode:#x} says that it has {length} bytes, {rest} are there")
            return
        whole = value[at:at + length]
        try:
            yield _operation(opcode, whole)
        except (ValueError, error) as problem:
            yield Misshapen(whole, f"operation {opcode:#x}: {problem}")
        at += length


def _operation(opcode: int, whole: bytes) -> Operation:
    """Return one operation; raises ValueError or struct.error with the rule that it breaks."""
    if opcode == TRANSMIT:
        _, _, can_id, extended, remote, length = _TRANSMIT.unpack_from(whole)
        data = _data(whole, _TRANSMIT.size, length)
        if remote == 1 and not any(data):
            return _transmit(CanFrame(can_id, b"", _flag(extended), True, dlc=length))
        return _transmit(CanFrame(can_id, data, _flag(extended), _flag(remote)))
    if opcode == FD_TRANSMIT:
        _, _, can_id, extended, switch, passive, length = _FD_TRANSMIT.unpack_from(whole)
        return _transmit(CanFrame(can_id, _data(whole, _FD_TRANSMIT.size, length), _flag(extended), fd=True,
                                  bit_rate_switch=_flag(switch), error_state=_flag(passive)))
    if opcode == FORMAT_ERROR:
        _, _, length = _FORMAT_ERROR.unpack_from(whole)
        return FormatError(_data(whole, _FORMAT_ERROR.size, length))
    if opcode == CONFIGURATION:
        parameter = Parameter(*_exactly(whole, "B", partly=True))
        if parameter is Parameter.ARBITRATION_LOST_BEHAVIOR:
            return Configuration(parameter, Behavior(_exactly(whole, "BB")[1]))
        return Configuration(parameter, _exactly(whole, "BI")[1])
    if opcode == STATUS:
        return Status(NodeStatus(*_exactly(whole, "B")))
    if opcode == WAKEUP:
        _exactly(whole, "")
        return Wakeup()
    if opcode == XL_TRANSMIT:
        raise ValueError("CAN XL is not supported")
    raise ValueError("no operation that an FMU sends to a CAN bus")


def _transmit(frame: CanFrame) -> Transmit:
    """Return the operation; raises MalformedFrame, a ValueError, for what is no frame."""
    pack(frame)
    return Transmit(frame)


def _data(whole: bytes, start: int, length: int) -> bytes:
    if start + length != len(whole):
        raise ValueError(f"says {length} bytes of data, {len(whole) - start} are there")
    return whole[start:]


def _flag(value: int) -> bool:
    if value not in (0, 1):
        raise MalformedFrame(f"a flag is {value}: expected 0 or 1")
    return value == 1


def _exactly(whole: bytes, form: str, *, partly: bool = False) -> tuple[int, ...]:
    """Return the arguments after the header, by `form` of struct; raises ValueError for another length."""
    arguments = Struct(f"<{form}")
    if len(whole) != HEADER.size + arguments.size and not partly:
        raise ValueError(f"has {len(whole) - HEADER.size} bytes of arguments, expected {arguments.size}")
    return unpack_from(arguments.format, whole, HEADER.size)


def transmit(frame: CanFrame) -> bytes:
    """Return the operation by which an FMU receives a frame."""
    data = bytes(frame.dlc if frame.dlc > 0 else 0) if frame.remote else frame.data
    if frame.fd:
        return _FD_TRANSMIT.pack(FD_TRANSMIT, _FD_TRANSMIT.size + len(data), frame.can_id, frame.extended,
                                 frame.bit_rate_switch, frame.error_state, len(data)) + data
    return _TRANSMIT.pack(TRANSMIT, _TRANSMIT.size + len(data), frame.can_id, frame.extended, frame.remote,
                          len(data)) + data


def confirm(can_id: int) -> bytes:
    return _ID.pack(CONFIRM, _ID.size, can_id)


def arbitration_lost(can_id: int) -> bytes:
    return _ID.pack(ARBITRATION_LOST, _ID.size, can_id)


def bus_error(can_id: int, code: int, *, primary: bool, is_sender: bool) -> bytes:
    return _BUS_ERROR.pack(BUS_ERROR, _BUS_ERROR.size, can_id, code, 1 if primary else 2, is_sender)


def wakeup() -> bytes:
    return HEADER.pack(WAKEUP, HEADER.size)


def format_error(data: bytes, most_bytes: int | None) -> bytes:
    """Return the answer to a misshapen operation, which repeats as much of it as `most_bytes` of Rx_Data hold."""
    room = MOST_DATA if most_bytes is None else max(0, min(MOST_DATA, most_bytes - _FORMAT_ERROR.size))
    data = data[:room]
    return _FORMAT_ERROR.pack(FORMAT_ERROR, _FORMAT_ERROR.size + len(data), len(data)) + data
