"""Rate limit: the link sends one copy after the other at `rate_bps` and drops a copy that finds its queue full.

The queue is that of `netem.core.drop_tail`: `queue_frames` copies, `queue_bytes`, `overhead_bytes` included, or
a wait of `queue_ns`.
Copies leave in the order in which they entered, not by arrival: list `rate_limit` before a `delay` with jitter.
The queue drains in order past the end of a time window. A copy that enters after it leaves no earlier than the last one
of the queue; it needs no sending time, takes no place in the queue and is never dropped.

Not modelled: token buckets (`tc tbf`), more than one queue, active queue management.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from msgspec.structs import replace

from netem.core.drop_tail import DropTailQueue
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

    def __post_init__(self) -> None:
        expect_at_least("rate_bps", self.rate_bps, 1)
        expect_at_least("overhead_bytes", self.overhead_bytes, 0)
        expect_at_least("queue_frames", self.queue_frames, 0)
        if self.queue_bytes is not None:
            expect_at_least("queue_bytes", self.queue_bytes, 0)
        if self.queue_ns is not None:
            expect_at_least("queue_ns", self.queue_ns, 0)
        self._queue = DropTailQueue(self.rate_bps, self.queue_frames, self.queue_bytes, self.queue_ns)

    def carry(self, transit: Transit) -> Iterator[Transit]:
        sent_ns = self._queue.take(len(transit.data) + self.overhead_bytes, transit.arrival_ns)
        if sent_ns is not None:
            yield replace(transit, arrival_ns=sent_ns)

    def carry_outside(self, transit: Transit) -> Transit:
        """Delay a copy from outside the time window until the queue has drained."""
        return not_before(transit, self._queue.free_ns)

    def least_delay_ns(self, size_bytes: int) -> int:
        """The sending time of a copy of this size."""
        return self._queue.sending_ns(size_bytes + self.overhead_bytes)

    def most_delay_ns(self, flow: Flow) -> int:
        """The sending time of all frames of one interval, if they fit into the interval (Lindley's recursion).

        Otherwise the queue fills up, and a copy waits for the one being sent and for a full queue, itself included.
        """
        sending_ns = [self._queue.sending_ns(size + self.overhead_bytes) for size in flow.sizes_bytes]
        interval_ns = flow.copies * sum(sending_ns)
        if interval_ns <= flow.every_ns:
            return interval_ns
        full_ns = self.queue_frames * max(sending_ns)
        if self.queue_bytes is not None:
            full_ns = min(full_ns, self._queue.sending_ns(self.queue_bytes) + self.queue_frames)      # each rounded up
        if self.queue_ns is not None:
            full_ns = min(full_ns, self.queue_ns)       # waits so long, then is sent
        return max(sending_ns) + full_ns
