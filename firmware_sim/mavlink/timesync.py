"""TIMESYNC of MAVLink as gateways watch it and ask by it: who asks sends ts1, who answers adds its clock as tc1.

    question: tc1 = 0, ts1 = the asking clock [ns]      answer: tc1 = the answering clock [ns], ts1 as it was asked

Source: mavlink.io, Time Synchronization Protocol v2. Messages of MAVLink 1 and broken frames are passed over.
"""

from __future__ import annotations

from typing import Final

from firmware_sim.mavlink.dialect import layout_of, message, pack, unpack
from firmware_sim.mavlink.framing import START, FrameReader, build
from netem.gateways.time_watch import TimeMessage

NAME: Final = "TIMESYNC"
MARK: Final = b"\x6f\x00\x00"           # its number, 111, in a frame
SYSTEM, COMPONENT = 255, 190            # of a ground station, which autopilots answer


class Timesync:
    """A `TimeProtocol`; a question's token is its ts1."""

    def __init__(self) -> None:
        self._sequence = 0

    def read(self, data: bytes) -> list[TimeMessage]:
        if MARK not in data or START not in data:       # most messages: no reader is needed
            return []
        return [TimeMessage(fields["ts1"], fields["tc1"] or None) for frame in FrameReader().read(data)
                if frame.layout.name == NAME for fields in [unpack(frame.layout, frame.payload)]]

    def question(self, token: int) -> bytes:
        self._sequence = (self._sequence + 1) % 256
        return build(layout_of(NAME), pack(message(NAME, ts1=token)), self._sequence, SYSTEM, COMPONENT)
