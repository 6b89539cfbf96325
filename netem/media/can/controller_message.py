"""What a controller tells its node of itself: SocketCAN's error messages about its state.

    can_id   ERR flag and class: CRTL 0x004, BUSOFF 0x040, RESTARTED 0x100, and CNT 0x200 since data has the counters
    data[1]  of CRTL: 0x10 error-passive by REC, 0x20 by TEC, 0x40 error-active again        data[6], data[7]  TEC, REC

Source: include/uapi/linux/can/error.h.

Not modelled: messages about single errors, and the warning level of 96.
"""

from __future__ import annotations

from netem.media.can.fault_confinement import PASSIVE_ABOVE, FaultConfinement, State
from netem.media.can.frame import CanFrame, pack

CONTROLLER = 0x004
BUS_OFF = 0x040
RESTARTED = 0x100
WITH_COUNTERS = 0x200
PASSIVE_AS_RECEIVER, PASSIVE_AS_SENDER, ACTIVE = 0x10, 0x20, 0x40


def state_message(faults: FaultConfinement, before: State) -> bytes:
    """The struct for a change from `before` to the present state."""
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
