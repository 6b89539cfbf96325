"""A CAN bus on a bench: scripted offers in, what its links received, the ledger closed and it told out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from random import Random
from typing import Any

from netem.core.agenda import OFFER, Agenda
from netem.core.fate import Fate
from netem.media.can.bus import CanBus
from netem.media.can.frame import CanFrame, pack
from netem.media.can.settings import CanSettings
from netem.media.links import Links
from netem.media.observation import MediumObserver
from netem.records.ledger import COLUMNS, Ledger

END_NS = 10**12
BIT = 2_000             # ns at 500 kbit/s
US = 1_000
MS = 1_000_000


class CanBench:
    def __init__(self, nodes: Iterable[str] = ("a", "b", "c"), *, rng_for: Callable[[str], Random] | None = None,
                 end_ns: int = END_NS, **settings: Any) -> None:
        self.agenda = Agenda()
        self.ledger = Ledger()
        self.arrivals: list[tuple[int, str, bytes]] = []
        self.events: list[tuple[int, str, str, str]] = []
        self.loads: list[tuple[int, float]] = []
        self.bounds_ns: list[int] = []
        self.end_ns = end_ns
        links = Links(self.ledger, self._deliver, {})
        self.bus = CanBus("can", CanSettings(**{"bit_rate_bps": 500_000, **settings}), nodes, self.agenda, self.ledger,
                          links, rng_for or (lambda place: Random(f"7/{place}")))
        self.bus.observe(MediumObserver(lambda event: self.events.append(event[:4]),
                                        lambda medium, time_ns, values: self.loads.append((time_ns, values[0]))))

    def _deliver(self, receiver: str, medium: str, arrival_ns: int, data: bytes) -> None:
        assert all(arrival_ns >= bound_ns for bound_ns in self.bounds_ns)
        if arrival_ns < self.end_ns:
            self.arrivals.append((arrival_ns, receiver, data))

    def offer(self, at_ns: int, sender: str, frame: CanFrame | bytes) -> None:
        data = frame if isinstance(frame, bytes) else pack(frame)
        self.agenda.at(at_ns, OFFER, sender, partial(self.bus.offer, sender, data, at_ns))

    def run(self, *offers: tuple[int, str, CanFrame | bytes]) -> CanBench:
        for at_ns, sender, frame in offers:
            self.offer(at_ns, sender, frame)
        self.agenda.run_before(self.end_ns)
        self.bus.finish(self.end_ns)
        self.ledger.finish(end_ns=self.end_ns)
        return self

    @property
    def counted(self) -> Mapping[str, int]:
        """Counters of the bus itself."""
        return self.bus.counters()["can"]

    def rows(self, sender: str | None = None, receiver: str | None = None) -> list[dict[str, Any]]:
        named = [dict(zip(COLUMNS, row, strict=True)) for row in self.ledger.rows]
        return [row for row in named if (sender is None or row["sender"] == sender)
                and (receiver is None or row["receiver"] == receiver)]

    def fates(self, sender: str, receiver: str) -> list[Fate]:
        return [Fate(row["fate"]) for row in sorted(self.rows(sender, receiver), key=lambda row: row["number"])]

    def kinds(self, node: str | None = None) -> list[str]:
        return [kind for _, name, kind, _ in sorted(self.events, key=lambda event: event[0])
                if node is None or name == node]
