"""Messages between a node and its own CAN controller about single frames, for nodes in `notifications_to`.

    controller to node   CONFIRM      a frame of the node got through
                         LOST         the frame lost arbitration and was discarded, as the node asked for
                         BUS_ERROR    an error frame destroyed a frame on the bus
                         WAKEUP       another node woke the bus up
    node to controller   ONE_SHOT     discard a frame that loses arbitration, and say so; or not any more
                         STATUS       the state of the node's own count of errors: only bus-off has an effect
                         WAKEUP       wake the other nodes up

They are `canfd_frame` structs with the ERR flag: can_id has a class of linux/can/error.h (LOSTARB 0x002, BUSERROR
0x080) or one that Linux does not use, and data has can_id u32 of the frame, then three bytes, little endian:

    LOST        number of the identifier's bit at which it lost, from SOF = 0      -            -
    BUS_ERROR   cause, by its place in `CAUSES`                                    detected it  sent the frame
    ONE_SHOT    on                                                                 -            -
    STATUS      1 error-active, 2 error-passive, 3 bus-off                         -            -

Differs from Linux: the layout of data, as SocketCAN does not say which frame a message is about.
"""

from __future__ import annotations

from enum import IntEnum
from struct import Struct
from typing import Final, NamedTuple

from netem.media.can.error_frame import Cause
from netem.media.can.frame import ERROR_FLAG, FD_BYTES, CanFrame, pack

CAUSES: Final = (Cause.BIT, Cause.STUFF, Cause.FORM, Cause.ACK)
BUS_OFF: Final = 3
_LAYOUT: Final = Struct("<IBBB")
_ERROR_BYTE: Final = ERROR_FLAG >> 24


class Kind(IntEnum):
    LOST = 0x002
    BUS_ERROR = 0x080
    CONFIRM = 0x800
    WAKEUP = 0x1000
    ONE_SHOT = 0x2000
    STATUS = 0x4000


class ControllerMessage(NamedTuple):
    kind: Kind
    can_id: int = 0
    first: int = 0
    second: int = 0
    third: int = 0


def encode(message: ControllerMessage) -> bytes:
    return pack(CanFrame(message.kind, _LAYOUT.pack(*message[1:]), fd=True, error=True))


def decode(frame: CanFrame) -> ControllerMessage | None:
    """Return the message in a frame; None if it is none."""
    if not (frame.error and frame.fd) or frame.can_id not in list(Kind):
        return None
    return ControllerMessage(Kind(frame.can_id), *_LAYOUT.unpack_from(frame.data))


def is_message(data: bytes) -> bool:
    """True for bytes that a node hands to its controller and that are no frame for the bus."""
    return len(data) == FD_BYTES and bool(data[3] & _ERROR_BYTE)
