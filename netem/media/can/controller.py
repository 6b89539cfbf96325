"""The bus's record of one node's CAN controller."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Final

from netem.core.frame import Frame
from netem.media.can.bus_off_recovery import BusOffRecovery
from netem.media.can.fault_confinement import FaultConfinement, State
from netem.media.can.transmit_queue import TransmitQueue

COUNTERS: Final = ("queue_full", "malformed", "collisions", "transmit_errors", "no_acknowledgement",
                   *(state.name.lower() for state in State))


class Controller:
    """State of one controller.

    `retransmissions` maps the number of a frame that receivers have taken, but whose sender has to repeat it, to how
    often that happened.
    """

    __slots__ = ("counters", "faults", "hears_itself", "name", "notified", "number", "one_shot", "queue", "ready_ns",
                 "receivers", "recovery", "retransmissions", "unacknowledged")

    def __init__(self, name: str, receivers: tuple[str, ...], queue: TransmitQueue, *, hears_itself: bool,
                 notified: bool = False) -> None:
        self.name = name
        self.receivers = receivers
        self.hears_itself = hears_itself
        self.notified = notified        # it tells its node about single frames
        self.one_shot = False           # a frame that loses arbitration is discarded
        self.queue = queue
        self.faults = FaultConfinement()
        self.ready_ns = 0               # end of its suspension: it starts no frame before
        self.number = 0                 # number of its next frame
        self.recovery: BusOffRecovery | None = None
        self.unacknowledged = False     # True if its last transmission was not acknowledged
        self.retransmissions: dict[int, int] = {}
        self.counters: Counter[str] = Counter(dict.fromkeys(COUNTERS, 0))

    @property
    def bus_off(self) -> bool:
        return self.faults.state is State.BUS_OFF

    def copies(self) -> int:
        return len(self.receivers) + self.hears_itself

    def open_copies(self, frame: Frame) -> Iterator[str]:
        """Receivers whose copies have no fate yet."""
        if frame.number not in self.retransmissions:
            yield from self.receivers
        if self.hears_itself:
            yield self.name
