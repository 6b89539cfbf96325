"""Links that repeat what became of the copies of an earlier run, instead of impairing them.

A copy that a receiver decodes gets the fates and delays recorded for the frame with the same number of its link, or
for the frame that was offered there next to the same instant. A copy without a record passes as on a link without
impairments. A copy that the medium loses now does not get here, whatever was recorded: its record is not met.

Not modelled: what another program would have done to the channel; a copy arrives no earlier than the medium delivers.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.core.link_name import LinkName
from netem.core.transit import Transit
from netem.media.links import Deliver, Links
from netem.records.ledger import Ledger

RECORDED = "as recorded"        # the cause of a fate, in the ledger
SETTLED_ELSEWHERE = (Fate.RECEIVER_GONE, Fate.RECEIVER_PAUSED, Fate.UNFINISHED)    # the receiver's, or the run's end


class RecordedCopy(NamedTuple):
    fate: Fate
    delay_ns: int               # from the end of the frame to its arrival at the node


class RecordedFrame(NamedTuple):
    number: int                 # of its sender
    offered_ns: int
    copies: tuple[RecordedCopy, ...]


class ReplayedLinks(Links):
    """`recorded` has the frames of each link in the order of their numbers; `by_instant` matches them so."""

    def __init__(self, ledger: Ledger, deliver: Deliver, recorded: Mapping[LinkName, Sequence[RecordedFrame]],
                 by_instant: bool) -> None:
        super().__init__(ledger, deliver, {})
        self._recorded = recorded
        self._by_instant = by_instant
        self._place = {link: {frame.number: place for place, frame in enumerate(frames)}
                       for link, frames in recorded.items()}
        self._instants = {link: [frame.offered_ns for frame in frames] for link, frames in recorded.items()}
        self._met: dict[LinkName, set[int]] = {}
        self.counted: Counter[str] = Counter()

    def receive(self, frame: Frame, receiver: str, arrival_ns: int, *, checksum: bool, copy: int = 0) -> None:
        link = (frame.medium, frame.sender, receiver)
        place = self._match(link, frame)
        if place is None or copy:
            self.counted["without a record"] += 1
            super().receive(frame, receiver, arrival_ns, checksum=checksum, copy=copy)
            return
        self._met.setdefault(link, set()).add(place)
        copies = self._recorded[link][place].copies
        self._ledger.expect(len(copies) - 1, frame.medium)
        for number, (fate, delay_ns) in enumerate(copies):
            if fate.arrived or fate in SETTLED_ELSEWHERE:
                recorded_ns = frame.end_ns + delay_ns if fate.arrived else arrival_ns
                if recorded_ns < arrival_ns:
                    self.counted["later than recorded"] += 1
                at_ns = max(recorded_ns, arrival_ns)
                self._deliver(receiver, frame.medium, at_ns, frame.data)
                self._ledger.close(frame, receiver, Fate.DELIVERED, copy=number, delivered_ns=at_ns)
            else:
                self._ledger.close(frame, receiver, fate, copy=number, cause=RECORDED)
            self.counted["as recorded"] += 1

    def impair_fragment(self, frame: Frame, receiver: str, arrival_ns: int,
                        data: bytes) -> tuple[list[Transit], Fate, str]:
        """Let every part pass: the record is that of the whole frame."""
        return [Transit(0, arrival_ns, arrival_ns, data)], Fate.DELIVERED, ""

    def receive_whole(self, frame: Frame, receiver: str, copy: Transit, *, checksum: bool) -> None:
        self.receive(frame, receiver, copy.arrival_ns, checksum=checksum)

    def unmet(self) -> int:
        """Return the number of recorded frames of links that no copy has met."""
        return sum(len(frames) - len(self._met.get(link, ())) for link, frames in self._recorded.items())

    def _match(self, link: LinkName, frame: Frame) -> int | None:
        """Return the place of the record for this frame, None if there is none."""
        if not self._by_instant:
            return self._place.get(link, {}).get(frame.number)
        instants = self._instants.get(link)
        if not instants:
            return None
        place = bisect_left(instants, frame.offered_ns)
        if place == len(instants) or (place and frame.offered_ns - instants[place - 1] <= instants[place]
                                      - frame.offered_ns):
            place -= 1
        return place
