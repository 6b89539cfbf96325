"""SocketCAN's error messages by which a controller reports its state to its node: encoder and decoder.

    can_id   ERR flag and class: CRTL 0x004, BUSOFF 0x040, RESTARTED 0x100, and CNT 0x200 since data has the counters
    data[1]  of CRTL: 0x10 error-passive by REC, 0x20 by TEC, 0x40 error-active again        data[6], data[7]  TEC, REC

Source: include/uapi/linux/can/error.h.

Not modelled: messages about single errors, and the warning level of 96.
"""

from __future__ import annotations

from typing import Final

from netem.media.can.fault_confinement import PASSIVE_ABOVE, FaultConfinement, State
from netem.media.can.frame import CanFrame, pack

CONTROLLER: Final = 0x004
BUS_OFF: Final = 0x040
RESTARTED: Final = 0x100
WITH_COUNTERS: Final = 0x200
PASSIVE_AS_RECEIVER: Final = 0x10
PASSIVE_AS_SENDER: Final = 0x20
ACTIVE: Final = 0x40


def state_message(faults: FaultConfinement, before: State) -> bytes:
    """Return the message, a `can_frame` struct, for a change from `before` to the present state."""
    data = bytearray(8)
    data[6], data[7] = min(faults.transmit_errors, 255), min(faults.receive_errors, 255)
    if faults.state is State.BUS_OFF:
        kind = BUS_OFF
    elif before is State.BUS_OFF:
        kind = RESTARTED
    else:
        kind = CONTROLLER
        if faults.state is State.ERROR_ACTIVE:
            data[1] = ACTIVE
        else:
            data[1] = (PASSIVE_AS_SENDER * (faults.transmit_errors > PASSIVE_ABOVE)
                       | PASSIVE_AS_RECEIVER * (faults.receive_errors > PASSIVE_ABOVE))
    return pack(CanFrame(kind | WITH_COUNTERS, bytes(data), error=True))


def state_after(message: CanFrame, before: State) -> State:
    """Return the controller's state after `message`; `before` if the message is not about the state."""
    if message.can_id & BUS_OFF:
        return State.BUS_OFF
    if message.can_id & RESTARTED:
        return State.ERROR_ACTIVE
    if message.can_id & CONTROLLER and len(message.data) > 1:
        if message.data[1] & (PASSIVE_AS_RECEIVER | PASSIVE_AS_SENDER):
            return State.ERROR_PASSIVE
        if message.data[1] & ACTIVE:
            return State.ERROR_ACTIVE
    return before
