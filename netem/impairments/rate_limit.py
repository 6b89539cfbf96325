"""Rate limit: the link sends one copy after the other at `rate_bps` and drops a copy that finds its queue full.

    start[k] = max(arrival[k], end[k-1])                                              (Lindley 1952)       [ns]
    end[k] = start[k] + ceil(8e9 (bytes[k] + overhead_bytes) / rate_bps)              the copy leaves the link   [ns]

A copy is in the queue during [arrival, start), not while it is sent. A copy that has to wait is dropped if
`queue_frames` copies wait already, if more than `queue_bytes` would wait, overhead included, or if it would wait for
more than `queue_ns`.
Copies leave in the order in which they entered, not by arrival: list `rate_limit` before a `delay` with jitter.
The queue drains in order past the end of a time window. A copy that enters after it leaves no earlier than the last one
of the queue; it needs no sending time, takes no place in the queue and is never dropped.

Not modelled: token buckets (`tc tbf`), more than one queue, active queue management.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar

from msgspec.structs import replace

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment
from netem.impairments.checks import expect_at_least
from netem.impairments.flow import Flow
from netem.impairments.order import not_before


@dataclass
class RateLimit(Impairment):
    loses_as: ClassVar[Fate] = Fate.QUEUE_FULL

    rate_bps: int                           # >= 1
    overhead_bytes: int = 0                 # >= 0, added to every frame
    queue_frames: int = 1000                # >= 0 (1000 is netem's default)
    queue_bytes: int | None = None          # >= 0, None: bytes do not limit
    queue_ns: int | None = None             # >= 0, longest wait; None: time does not limit
    free_ns: int = field(default=0, init=False)     # instant at which the last accepted copy has been sent

    def __post_init__(self) -> None:
        expect_at_least("rate_bps", self.rate_bps, 1)
        expect_at_least("overhead_bytes", self.overhead_bytes, 0)
        expect_at_least("queue_frames", self.queue_frames, 0)
        if self.queue_bytes is not None:
            expect_at_least("queue_bytes", self.queue_bytes, 0)
        if self.queue_ns is not None:
            expect_at_least("queue_ns", self.queue_ns, 0)
        self._waiting: deque[tuple[int, int]] = deque()     # (start_ns, bytes)
        self._waiting_bytes = 0

    def carry(self, transit: Transit) -> Iterator[Transit]:
        arrival_ns, waiting = transit.arrival_ns, self._waiting
        size = len(transit.data) + self.overhead_bytes
        while waiting and waiting[0][0] <= arrival_ns:
            self._waiting_bytes -= waiting.popleft()[1]
        start_ns = max(arrival_ns, self.free_ns)
        if start_ns > arrival_ns:
            if len(waiting) >= self.queue_frames:
                return
            if self.queue_bytes is not None and self._waiting_bytes + size > self.queue_bytes:
                return
            if self.queue_ns is not None and start_ns - arrival_ns > self.queue_ns:
                return
            waiting.append((start_ns, size))
            self._waiting_bytes += size
        self.free_ns = start_ns + self._sending_ns(size)
        yield replace(transit, arrival_ns=self.free_ns)

    def carry_outside(self, transit: Transit) -> Transit:
        """Delay a copy from outside the time window until the queue has drained."""
        return not_before(transit, self.free_ns)

    def least_delay_ns(self, size_bytes: int) -> int:
        """The sending time of a copy of this size."""
        return self._sending_ns(size_bytes + self.overhead_bytes)

    def most_delay_ns(self, flow: Flow) -> int:
        """The sending time of all frames of one interval, if they fit into the interval (Lindley's recursion).

        Otherwise the queue fills up, and a copy waits for the one being sent and for a full queue, itself included.
        """
        sending_ns = [self._sending_ns(size + self.overhead_bytes) for size in flow.sizes_bytes]
        interval_ns = flow.copies * sum(sending_ns)
        if interval_ns <= flow.every_ns:
            return interval_ns
        full_ns = self.queue_frames * max(sending_ns)
        if self.queue_bytes is not None:
            full_ns = min(full_ns, self._sending_ns(self.queue_bytes) + self.queue_frames)      # each rounded up
        if self.queue_ns is not None:
            full_ns = min(full_ns, self.queue_ns)       # waits so long, then is sent
        return max(sending_ns) + full_ns

    def _sending_ns(self, size_bytes: int) -> int:
        return -(-8_000_000_000 * size_bytes // self.rate_bps)
