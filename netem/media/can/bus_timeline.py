"""Keeps the instants at which a bus becomes free, and free for an error-passive sender, which waits 8 more bits.

    |<- frame or frame and error frame ->|<- intermission 3 ->|<- suspension 8, of an error-passive sender ->|
    origin .. start                     end                 free                                          resume

Frames that follow each other without idle time share one origin, from which their bits are added before rounding; so
rounding errors do not add up. A start after idle time is a new origin.
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
        """Ticks from the origin to a frame that starts at `now_ns`, 0 if that is a new origin."""
        if now_ns == self.free_ns:
            return self._free_ticks
        if now_ns == self.resume_ns:
            return self._resume_ticks
        self._origin_ns = now_ns
        return 0

    def instant(self, ticks: int) -> int:
        return self._origin_ns + self.clock.ns(ticks)

    def busy_until(self, end_ticks: int) -> None:
        """The bus is busy until the end of a frame or of an error delimiter; set `free_ns` and `resume_ns`."""
        clock = self.clock
        self._free_ticks = end_ticks + INTERMISSION_BITS * clock.nominal
        self._resume_ticks = self._free_ticks + SUSPENSION_BITS * clock.nominal
        self.free_ns = self._origin_ns + clock.ns(self._free_ticks)
        self.resume_ns = self._origin_ns + clock.ns(self._resume_ticks)
