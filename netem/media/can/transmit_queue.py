"""The frames that wait for the bus in one controller.

    priority    lowest identifier first, equal ones in order of arrival: a controller with many transmit buffers
    fifo        in order of arrival: a driver with one queue, where a high identifier can delay a lower one
    mailbox     one place for each identifier, lowest first; a newer frame replaces one that still waits

The frame that is on the bus is not in the queue. A frame that has to be retransmitted keeps its place.
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
    """Holds at most `capacity` frames."""

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
        """Queue a frame; returns (frame, reason) if this frame or an older one has no place, otherwise None."""
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
        """Remove and return all frames, in their order."""
        frames = [frame for _, _, frame, _ in sorted(self.waiting, key=lambda entry: entry[:2])]
        self.waiting.clear()
        return frames
