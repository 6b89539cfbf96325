"""One end of a serial line: a transmit buffer, and a shift register that holds the byte being sent.

Invariants:
- `begin_ns` and `sent` describe the last run of bytes without a gap: its k-th byte ends at begin_ns + clock.end_ns(k);
- a byte leaves the buffer when it begins on the line, so `waiting` counts those that have not begun.
"""

from __future__ import annotations

from dataclasses import dataclass

from netem.media.serial_line.byte_clock import ByteClock


@dataclass
class Transmitter:
    clock: ByteClock
    buffer_bytes: int
    begin_ns: int = 0
    sent: int = 0           # bytes of the run, including those that wait

    def free_ns(self) -> int:
        """Instant at which the last byte taken so far ends."""
        return self.begin_ns + self.clock.end_ns(self.sent)

    def waiting(self, now_ns: int) -> int:
        """Bytes in the buffer at `now_ns`, not earlier than the last call of `take`."""
        if now_ns >= self.free_ns():
            return 0
        return max(0, self.sent - self.clock.begun(now_ns - self.begin_ns))

    def room(self, now_ns: int) -> int:
        """Number of bytes that can be taken at `now_ns`; an idle shift register takes one at once."""
        return self.buffer_bytes - self.waiting(now_ns) + (now_ns >= self.free_ns())

    def take(self, count: int, now_ns: int) -> int:
        """Queue `count` bytes; returns the instant at which the first of them begins."""
        if now_ns >= self.free_ns():
            self.begin_ns, self.sent = now_ns, 0
        first_ns = self.free_ns()
        self.sent += count
        return first_ns

    def end_ns(self, back: int = 0) -> int:
        """Instant at which the byte `back` bytes before the last one taken ends."""
        return self.begin_ns + self.clock.end_ns(self.sent - back)
