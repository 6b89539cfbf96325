"""No media access: a frame's transmission starts at its offer, so the firmware decides when.

A frame that is offered while its sender is transmitting is dropped (`Fate.SENDER_BUSY`); that on the air is completed.
"""

from __future__ import annotations

from collections.abc import Iterable

from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.media.mac import Channel


class NoMac:
    senses = False
    min_wait_ns = 0

    def __init__(self, channel: Channel) -> None:
        self._channel = channel

    def submit(self, frame: Frame, now_ns: int) -> None:
        if self._channel.transmitting(frame.sender):
            self._channel.drop(frame, Fate.SENDER_BUSY)
        else:
            self._channel.start(frame, now_ns)

    def sent(self, node: str, now_ns: int) -> None: ...

    def heard(self, node: str, now_ns: int) -> None: ...

    def cleared(self, node: str, now_ns: int) -> None: ...

    def waiting(self) -> Iterable[Frame]:
        return ()
