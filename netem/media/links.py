"""Directed links: a received copy passes the impairments of its link and arrives at its node, or does not.

Invariants:
- every copy that enters `receive` was announced to the ledger and is closed there, duplicates included;
- the impairments of one link see copies in the order in which the medium received them;
- a copy's arrival is known, and handed over, as soon as its link has dealt with it: never less than its arrival ahead;
  the ledger settles what becomes of one that the end of the run, or of its receiver, comes before.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.core.link_name import LinkName
from netem.core.transit import Transit
from netem.impairments import Impairment
from netem.records.ledger import Ledger

Deliver = Callable[[str, str, int, bytes], object]      # (receiver, medium, arrival_ns, data)


class Links:
    """`pipelines` maps (medium, sender, receiver) to (name, impairment) pairs in their order in the scenario."""

    def __init__(self, ledger: Ledger, deliver: Deliver,
                 pipelines: Mapping[LinkName, Sequence[tuple[str, Impairment]]]) -> None:
        self._ledger = ledger
        self._deliver = deliver
        self._pipelines = pipelines
        self._entered: dict[LinkName, int] = {}

    def receive(self, frame: Frame, receiver: str, arrival_ns: int, *, checksum: bool, copy: int = 0) -> None:
        """A receiver decoded `frame`; it reaches the node at `arrival_ns` (>= now) unless the link impairs it.

        `copy` > 0: it did so `copy` times before, since the medium repeats what a receiver already has."""
        medium = frame.medium
        pipeline = self._pipelines.get((medium, frame.sender, receiver))
        if pipeline is not None:
            self._impair(pipeline, frame, receiver, arrival_ns, checksum, copy)
        else:
            self._deliver(receiver, medium, arrival_ns, frame.data)
            self._ledger.close(frame, receiver, Fate.DELIVERED, copy=copy, delivered_ns=arrival_ns)

    def tell(self, receiver: str, medium: str, arrival_ns: int, data: bytes) -> None:
        """What a node's own interface to the medium says of itself: nobody's frame, so not in the ledger."""
        self._deliver(receiver, medium, arrival_ns, data)

    def _impair(self, pipeline: Sequence[tuple[str, Impairment]], frame: Frame, receiver: str, arrival_ns: int,
                checksum: bool, copy_number: int) -> None:
        link = (frame.medium, frame.sender, receiver)
        number = self._entered.get(link, 0)
        self._entered[link] = number + 1
        copies = [Transit(number, arrival_ns, arrival_ns, frame.data, copy=copy_number)]
        born = copy_number + 1
        for name, impairment in pipeline:
            survivors: list[Transit] = []
            for copy in copies:
                out = list(impairment.carry(copy))
                if not out:
                    self._ledger.close(frame, receiver, impairment.loses_as, copy=copy.copy, cause=name)
                for extra in out[1:]:
                    extra.copy = born
                    born += 1
                    self._ledger.expect(1, frame.medium)
                survivors.extend(out)
            copies = survivors
        for copy in copies:
            if copy.corrupt and checksum:
                self._ledger.close(frame, receiver, Fate.CORRUPTED, copy=copy.copy, cause="checksum")
            else:
                self._deliver(receiver, frame.medium, copy.arrival_ns, copy.data)
                self._ledger.close(frame, receiver, Fate.DELIVERED_CORRUPT if copy.corrupt else Fate.DELIVERED,
                                   copy=copy.copy, delivered_ns=copy.arrival_ns)
