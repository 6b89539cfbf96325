"""Pure ALOHA: a radio transmits at once, even if others do (Abramson 1970). While it transmits, its frames queue.

At most `queue_frames` wait, not counting the one on the air; further ones are dropped (`Fate.QUEUE_FULL`). The next
frame starts at the instant at which the last one ends.
Not modelled: acknowledgement and retransmission, which a broadcast does not have.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from functools import partial

from netem.core.agenda import OFFER
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.media.mac import Channel


class Aloha:
    senses = False
    min_wait_ns = 0

    def __init__(self, channel: Channel, queue_frames: int) -> None:
        self._channel = channel
        self._queue_frames = queue_frames
        self._queues: dict[str, deque[Frame]] = {}      # only nodes whose queue is not empty
        self._due: dict[str, Frame] = {}                # frames that start at this instant

    def submit(self, frame: Frame, now_ns: int) -> None:
        sender = frame.sender
        if sender not in self._due and not self._channel.transmitting(sender):
            self._channel.start(frame, now_ns)
        elif len(self._queues.get(sender, ())) >= self._queue_frames:
            self._channel.drop(frame, Fate.QUEUE_FULL, "aloha")
        else:
            self._queues.setdefault(sender, deque()).append(frame)

    def sent(self, node: str, now_ns: int) -> None:
        queue = self._queues.get(node)
        if queue is not None:
            self._due[node] = queue.popleft()
            if not queue:
                del self._queues[node]
            self._channel.agenda.at(now_ns, OFFER, node, partial(self._start, node, now_ns))

    def _start(self, node: str, now_ns: int) -> None:
        self._channel.start(self._due.pop(node), now_ns)

    def heard(self, node: str, now_ns: int) -> None: ...

    def cleared(self, node: str, now_ns: int) -> None: ...

    def waiting(self) -> Iterable[Frame]:
        return [*self._due.values(), *(frame for queue in self._queues.values() for frame in queue)]
