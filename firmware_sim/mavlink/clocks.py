"""TIMESYNC and PING, by which the other end measures the vehicle's clock and the delay of the link.

    TIMESYNC: tc1 = 0, ts1 = theirs  -->  tc1 = the vehicle's local clock [ns], ts1 = theirs
    PING: to 0/0                     -->  the same, addressed to the sender

Source: mavlink.io, time synchronization and ping protocols.
"""

from __future__ import annotations

from firmware_sim.mavlink.dialect import Message, message
from firmware_sim.mavlink.link import Received


def answer(received: Received, now_ns: int) -> list[Message]:
    asked = received.message
    if asked.name == "TIMESYNC":
        if asked["tc1"]:
            return []                   # the message is itself an answer
        return [message("TIMESYNC", tc1=now_ns, ts1=asked["ts1"])]
    if asked["target_system"] or asked["target_component"]:
        return []
    return [message("PING", time_usec=asked["time_usec"], seq=asked["seq"], target_system=received.system,
                    target_component=received.component)]
