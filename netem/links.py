"""Directed links: a received copy passes the impairments of its link and arrives at its node, or does not.

Invariants:
- every copy that enters `receive` was announced to the ledger and is closed there, duplicates included;
- the impairments of one link see copies in the order in which the medium received them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from netem.agenda import ARRIVAL, Agenda
from netem.frames import Fate, Frame, Transit
from netem.impairments import Impairment
from netem.records.ledger import Ledger

Deliver = Callable[[str, str, int, bytes], bool]     # (receiver, medium, arrival_ns, data) -> False if the node is gone
LinkName = tuple[str, str, str]                      # (medium, sender, receiver)


class Links:
    """`pipelines` maps (medium, sender, receiver) to (name, impairment) pairs in their order in the scenario."""

    def __init__(self, agenda: Agenda, ledger: Ledger, deliver: Deliver,
                 pipelines: Mapping[LinkName, Sequence[tuple[str, Impairment]]]) -> None:
        self._agenda = agenda
        self._ledger = ledger
        self._deliver = deliver
        self._pipelines = pipelines
        self._entered: dict[LinkName, int] = {}
        self._under_way: dict[tuple[LinkName, int, int], tuple[Frame, Transit]] = {}

    def receive(self, frame: Frame, receiver: str, arrival_ns: int, *, checksum: bool) -> None:
        """A medium's receiver decoded `frame`; it reaches the node at `arrival_ns` (>= now) unless the link impairs it."""
        pipeline = self._pipelines.get((frame.medium, frame.sender, receiver))
        if pipeline is None:
            self._hand_over(frame, receiver, arrival_ns, frame.data, 0, False)
            return
        self._impair(pipeline, frame, receiver, arrival_ns, checksum)

    def _impair(self, pipeline: Sequence[tuple[str, Impairment]], frame: Frame, receiver: str, arrival_ns: int,
                checksum: bool) -> None:
        link = (frame.medium, frame.sender, receiver)
        number = self._entered.get(link, 0)
        self._entered[link] = number + 1
        copies = [Transit(number, arrival_ns, arrival_ns, frame.data)]
        born = 1
        for name, impairment in pipeline:
            survivors: list[Transit] = []
            for copy in copies:
                out = list(impairment.carry(copy))
                if not out:
                    self._ledger.close(frame, receiver, impairment.loses_as, copy=copy.copy, cause=name)
                for extra in out[1:]:
                    extra.copy = born
                    born += 1
                    self._ledger.expect(1)
                survivors.extend(out)
            copies = survivors
        for copy in copies:
            if copy.corrupt and checksum:
                self._ledger.close(frame, receiver, Fate.CORRUPTED, copy=copy.copy, cause="checksum")
                continue
            key = (link, number, copy.copy)
            self._under_way[key] = (frame, copy)
            self._agenda.at(copy.arrival_ns, ARRIVAL, f"{frame.medium}: {frame.sender} -> {receiver}",
                            partial(self._arrive, key))

    def _arrive(self, key: tuple[LinkName, int, int]) -> None:
        frame, copy = self._under_way.pop(key)
        self._hand_over(frame, key[0][2], copy.arrival_ns, copy.data, copy.copy, copy.corrupt)

    def _hand_over(self, frame: Frame, receiver: str, arrival_ns: int, data: bytes, copy: int, corrupt: bool) -> None:
        if not self._deliver(receiver, frame.medium, arrival_ns, data):
            self._ledger.close(frame, receiver, Fate.RECEIVER_GONE, copy=copy)
        else:
            self._ledger.close(frame, receiver, Fate.DELIVERED_CORRUPT if corrupt else Fate.DELIVERED, copy=copy,
                               delivered_ns=arrival_ns)

    def finish(self) -> None:
        """The run ended: what is still under way is unfinished."""
        for key in sorted(self._under_way):
            frame, copy = self._under_way[key]
            self._ledger.close(frame, key[0][2], Fate.UNFINISHED, copy=copy.copy)
        self._under_way.clear()
