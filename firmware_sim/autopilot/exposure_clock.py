"""Converts the time stamps of motion capture frames, read from the cameras' clock, to the board's clock.

    offset = least of (arrival - stamp), raised by `SLIP_PPM` since the last frame   exposed = stamp + offset - delay

The least delayed frame gives the clocks' difference plus the known `delay`; frames delayed on their way do not change
it. The slip lets the offset follow clocks that drift apart by less than it. If `PATIENCE` frames in a row seem delayed
by more than `HELD_UP_NS`, a clock was stepped: the last frame sets the offset.
Source: the minimum filter of NTP's clock filter (Mills 1991), with a slip instead of a window.
"""

from __future__ import annotations

from dataclasses import dataclass, field

SLIP_PPM = 200
HELD_UP_NS = 20_000_000
PATIENCE = 20


@dataclass
class ExposureClock:
    _offset_ns: int | None = field(default=None, init=False)
    _stamp_ns: int = field(default=0, init=False)
    _held_up: int = field(default=0, init=False)

    def exposed_ns(self, stamp_ns: int, arrival_ns: int, delay_ns: int) -> int | None:
        """Return the local time of the exposure; None if the frame is not newer than the last one."""
        offset_ns = arrival_ns - stamp_ns
        if self._offset_ns is not None:
            if stamp_ns <= self._stamp_ns:
                return None
            kept_ns = self._offset_ns + (stamp_ns - self._stamp_ns) * SLIP_PPM // 1_000_000
            self._held_up = self._held_up + 1 if offset_ns - kept_ns > HELD_UP_NS else 0
            if self._held_up < PATIENCE:
                offset_ns = min(offset_ns, kept_ns)
        self._offset_ns, self._stamp_ns = offset_ns, stamp_ns
        return stamp_ns + offset_ns - delay_ns
