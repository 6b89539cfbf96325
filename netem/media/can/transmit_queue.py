"""What waits in one controller for the bus.

    priority    lowest identifier first, one identifier in order: a controller with many transmit buffers
    fifo        in order: a driver with one queue, where a high identifier can keep a lower one waiting
    mailbox     one place for each identifier, lowest first; a newer frame takes the place of one that still waits

The frame that is on the bus is no longer here. A frame that did not get through stays at its place.
"""

from __future__ import annotations

from heapq import heappop, heappush
from typing import Final, Literal

from netem.core.frame import Frame
from netem.media.can.encoded_frame import EncodedFrame

Discipline = Literal["priority", "fifo", "mailbox"]
Waiting = tuple[int, int, Frame, EncodedFrame]        # (place, order of arrival, frame, its bits)

REPLACED: Final = "a newer frame took its mailbox"
FULL: Final = "transmit queue"


class TransmitQueue:
    """`capacity` frames wait at most."""

    __slots__ = ("_arrivals", "_by_rank", "_mailboxes", "capacity", "waiting")

    def __init__(self, discipline: Discipline, capacity: int) -> None:
        self.capacity = capacity
        self.waiting: list[Waiting] = []            # a heap
        self._by_rank = discipline != "fifo"
        self._mailboxes = discipline == "mailbox"
        self._arrivals = 0

    def __bool__(self) -> bool:
        return bool(self.waiting)

    def put(self, frame: Frame, encoded: EncodedFrame) -> tuple[Frame, str] | None:
        """Returns the frame that has no place (any more), and why."""
        waiting = self.waiting
        place = encoded.rank if self._by_rank else 0
        if self._mailboxes:
            for index, (rank, arrival, old, _) in enumerate(waiting):
                if rank == place:
                    waiting[index] = (rank, arrival, frame, encoded)
                    return old, REPLACED
        if len(waiting) >= self.capacity:
            return frame, FULL
        heappush(waiting, (place, self._arrivals, frame, encoded))
        self._arrivals += 1
        return None

    def head(self) -> Waiting:
        return self.waiting[0]

    def take(self) -> Waiting:
        return heappop(self.waiting)

    def drain(self) -> list[Frame]:
        """All that wait, in their order."""
        frames = [frame for _, _, frame, _ in sorted(self.waiting, key=lambda entry: entry[:2])]
        self.waiting.clear()
        return frames
