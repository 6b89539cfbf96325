"""The state of a CAN controller as its error messages report it, in the format of SocketCAN's drivers.

    class in can_id    CRTL 0x004, data[1]: 0x40 back to error-active, 0x10 error-passive as receiver, 0x20 as sender
                       BUSOFF 0x040         RESTARTED 0x100

Source: include/uapi/linux/can/error.h.
"""

from __future__ import annotations

from enum import Enum
from typing import Final

from netem.media.can.frame import CanFrame

CONTROLLER: Final = 0x004
BUS_OFF: Final = 0x040
RESTARTED: Final = 0x100
PASSIVE: Final = 0x10 | 0x20
ACTIVE: Final = 0x40


class ControllerState(Enum):
    ERROR_ACTIVE = "error-active"
    ERROR_PASSIVE = "error-passive"
    BUS_OFF = "bus-off"


def state_after(message: CanFrame, before: ControllerState) -> ControllerState:
    """Return the controller's state after an error message; `before` if the message is about something else."""
    if message.can_id & BUS_OFF:
        return ControllerState.BUS_OFF
    if message.can_id & RESTARTED:
        return ControllerState.ERROR_ACTIVE
    if message.can_id & CONTROLLER and len(message.data) > 1:
        if message.data[1] & PASSIVE:
            return ControllerState.ERROR_PASSIVE
        if message.data[1] & ACTIVE:
            return ControllerState.ERROR_ACTIVE
    return before
