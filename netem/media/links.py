"""Directed links: a received copy passes the impairments of its link, which lose it or give it an arrival at its node.

Invariants:
- every copy that enters `receive` was announced to the ledger and is closed there, duplicates included;
- the impairments of one link see copies in the order in which the medium received them;
- a copy is delivered, with its arrival instant, as soon as its link has decided, at or before its arrival. If the run
  or its receiver ends before the arrival, the ledger corrects the fate.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from mypy_extensions import mypyc_attr

from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.core.link_name import LinkName
from netem.core.transit import Transit
from netem.impairments import Impairment
from netem.records.ledger import Ledger

Deliver = Callable[[str, str, int, bytes], object]      # (receiver, medium, arrival_ns, data)


@mypyc_attr(allow_interpreted_subclasses=True)
class Links:
    """`pipelines` maps (medium, sender, receiver) to (name, impairment) pairs in their order in the scenario."""

    def __init__(self, ledger: Ledger, deliver: Deliver,
                 pipelines: Mapping[LinkName, Sequence[tuple[str, Impairment]]]) -> None:
        self._ledger = ledger
        self._deliver = deliver
        self._pipelines = {link: list(pipeline) for link, pipeline in pipelines.items()}
        self._entered: dict[LinkName, int] = {}

    def receive(self, frame: Frame, receiver: str, arrival_ns: int, *, checksum: bool, copy: int = 0) -> None:
        """Take the copy of `frame` that a receiver decoded and that reaches its node at `arrival_ns` (>= now).

        The impairments of the link may lose, delay, change or duplicate the copy. `copy` is the number of times that
        this receiver has decoded the frame before, as a medium may repeat a frame.
        """
        medium = frame.medium
        pipeline = self._pipelines.get((medium, frame.sender, receiver))
        if pipeline is not None:
            self._impair(pipeline, frame, receiver, arrival_ns, checksum, copy)
        else:
            self._deliver(receiver, medium, arrival_ns, frame.data)
            self._ledger.close(frame, receiver, Fate.DELIVERED, copy=copy, delivered_ns=arrival_ns)

    def pipeline(self, link: LinkName) -> list[tuple[str, Impairment]]:
        """Return the (name, impairment) pairs of a link in their order, to be changed before copies come."""
        return self._pipelines.setdefault(link, [])

    def tell(self, receiver: str, medium: str, arrival_ns: int, data: bytes) -> None:
        """Deliver a message of the node's own interface to the medium: no frame on the medium, so not in the ledger."""
        self._deliver(receiver, medium, arrival_ns, data)

    def impair_fragment(self, frame: Frame, receiver: str, arrival_ns: int,
                        data: bytes) -> tuple[list[Transit], Fate, str]:
        """Return the copies that leave the link of a part of a frame; if none does, the fate and cause of its loss.

        The medium puts the parts together and passes the whole to `receive_whole`, or closes the copy.
        """
        link = (frame.medium, frame.sender, receiver)
        number = self._entered.get(link, 0)
        self._entered[link] = number + 1
        copies = [Transit(number, arrival_ns, arrival_ns, data)]
        for name, impairment in self._pipelines.get(link, ()):
            copies = [out for copy in copies for out in impairment.carry(copy)]
            if not copies:
                return [], impairment.loses_as, name
        return copies, Fate.DELIVERED, ""

    def receive_whole(self, frame: Frame, receiver: str, copy: Transit, *, checksum: bool) -> None:
        """Take the copy that a medium has put together from parts, which have passed the impairments already."""
        self._leave(frame, receiver, copy, checksum)

    def _leave(self, frame: Frame, receiver: str, copy: Transit, checksum: bool) -> None:
        """Deliver a copy that has passed its link and close it; a corrupt one ends here if there is a `checksum`."""
        if copy.corrupt and checksum and not copy.undetected:
            self._ledger.close(frame, receiver, Fate.CORRUPTED, copy=copy.copy, cause="checksum")
        else:
            self._deliver(receiver, frame.medium, copy.arrival_ns, copy.data)
            self._ledger.close(frame, receiver, Fate.DELIVERED_CORRUPT if copy.corrupt else Fate.DELIVERED,
                               copy=copy.copy, delivered_ns=copy.arrival_ns)

    def _impair(self, pipeline: Sequence[tuple[str, Impairment]], frame: Frame, receiver: str, arrival_ns: int,
                checksum: bool, copy_number: int) -> None:
        link = (frame.medium, frame.sender, receiver)
        number = self._entered.get(link, 0)
        self._entered[link] = number + 1
        copies = [Transit(number, arrival_ns, arrival_ns, frame.data, copy=copy_number, frame=frame)]
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
            self._leave(frame, receiver, copy, checksum)
