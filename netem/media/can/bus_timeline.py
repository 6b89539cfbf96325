"""When a bus is busy, free, and free for a node that has to wait 8 bits more; no instant is a sum of rounded ones.

    |<- frame or frame and error frame ->|<- intermission 3 ->|<- suspension 8, of an error-passive sender ->|
    origin .. start                     end                 free                                          resume

Frames that follow each other share one origin, so their bits add up; a start after idle time is a new origin.
"""

from __future__ import annotations

from typing import Final

from netem.media.can.bit_clock import BitClock

INTERMISSION_BITS: Final = 3
SUSPENSION_BITS: Final = 8


class BusTimeline:
    """Ticks are those of `clock`, counted from the origin."""

    __slots__ = ("_free_ticks", "_origin_ns", "_resume_ticks", "clock", "free_ns", "resume_ns")

    def __init__(self, clock: BitClock) -> None:
        self.clock = clock
        self.free_ns = 0
        self.resume_ns = 0
        self._origin_ns = 0
        self._free_ticks = 0
        self._resume_ticks = 0

    def start(self, now_ns: int) -> int:
        """Ticks at a start."""
        if now_ns == self.free_ns:
            return self._free_ticks
        if now_ns == self.resume_ns:
            return self._resume_ticks
        self._origin_ns = now_ns
        return 0

    def instant(self, ticks: int) -> int:
        return self._origin_ns + self.clock.ns(ticks)

    def busy_until(self, end_ticks: int) -> None:
        """End of frame, or of the error delimiter."""
        clock = self.clock
        self._free_ticks = end_ticks + INTERMISSION_BITS * clock.nominal
        self._resume_ticks = self._free_ticks + SUSPENSION_BITS * clock.nominal
        self.free_ns = self._origin_ns + clock.ns(self._free_ticks)
        self.resume_ns = self._origin_ns + clock.ns(self._resume_ticks)
