"""A transmitter with a first-in-first-out queue of limited depth: what does not fit when it arrives is dropped.

    start[k] = max(arrival[k], end[k-1])                                              (Lindley 1952)       [ns]
    end[k] = start[k] + ceil(8e9 bytes[k] / rate_bps)                                 the last bit is sent [ns]

A packet is in the queue during [arrival, start), not while it is sent. A packet that has to wait is dropped if
`queue_packets` packets wait already, if more than `queue_bytes` would wait, or if it would wait for more than
`queue_ns`.

Not modelled: priorities, active queue management.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field


@dataclass
class DropTailQueue:
    rate_bps: int                           # >= 1
    queue_packets: int                      # >= 0
    queue_bytes: int | None = None          # >= 0, None: bytes do not limit
    queue_ns: int | None = None             # >= 0, longest wait; None: time does not limit
    free_ns: int = field(default=0, init=False)     # instant at which the last accepted packet has been sent

    def __post_init__(self) -> None:
        self._waiting: deque[tuple[int, int]] = deque()     # (start_ns, bytes)
        self._waiting_bytes = 0

    def take(self, size_bytes: int, arrival_ns: int) -> int | None:
        """Return the instant at which a packet that arrives at `arrival_ns` has been sent; None if it is dropped."""
        waiting = self._waiting
        while waiting and waiting[0][0] <= arrival_ns:
            self._waiting_bytes -= waiting.popleft()[1]
        start_ns = max(arrival_ns, self.free_ns)
        if start_ns > arrival_ns:
            if len(waiting) >= self.queue_packets:
                return None
            if self.queue_bytes is not None and self._waiting_bytes + size_bytes > self.queue_bytes:
                return None
            if self.queue_ns is not None and start_ns - arrival_ns > self.queue_ns:
                return None
            waiting.append((start_ns, size_bytes))
            self._waiting_bytes += size_bytes
        self.free_ns = start_ns + self.sending_ns(size_bytes)
        return self.free_ns

    def sending_ns(self, size_bytes: int) -> int:
        """Return the time from the first to the last bit of a packet."""
        return -(-8_000_000_000 * size_bytes // self.rate_bps)
