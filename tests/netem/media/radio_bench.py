"""A radio on a bench: scripted offers in, what its links received and what the ledger closed out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from random import Random
from typing import Any

from netem.core.agenda import OFFER, Agenda
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.core.link_name import LinkName
from netem.impairments import Impairment
from netem.media.broadcast_radio import BroadcastRadio
from netem.media.links import Links
from netem.media.radio_settings import CarrierSenseSettings, RadioSettings
from netem.records.ledger import Ledger
from netem.topology.fixed_graph import FixedGraph

END_NS = 10**15

# One byte takes one microsecond, nothing else takes time: a payload of n bytes is on the air for n us.
BYTE_PER_US: dict[str, Any] = {"bit_rate_bps": 8_000_000, "preamble_ns": 0, "header_bits": 0}
US = 1_000


class RecordingLedger(Ledger):
    def __init__(self) -> None:
        super().__init__()
        self.fates: dict[tuple[str, int, str], list[Fate]] = {}

    def close(self, frame, receiver, fate, **times):  # type: ignore[no-untyped-def]
        super().close(frame, receiver, fate, **times)
        self.fates.setdefault((frame.sender, frame.number, receiver), []).append(fate)


class RecordingRadio(BroadcastRadio):
    def __init__(self, flights: list[tuple[str, int, int, int]], *arguments: Any) -> None:
        super().__init__("radio", *arguments)
        self.flights = flights

    def start(self, frame: Frame, now_ns: int) -> None:
        super().start(frame, now_ns)
        self.flights.append((frame.sender, frame.number, frame.on_air_ns, frame.end_ns))


class Bench:
    def __init__(self, nodes: Any, rng_for: Callable[[str], Any] = lambda place: Random(f"7/{place}"),
                 pipelines: Mapping[LinkName, Sequence[tuple[str, Impairment]]] | None = None, **settings: Any) -> None:
        self.agenda = Agenda()
        self.ledger = RecordingLedger()
        self.heard: list[tuple[int, str, bytes]] = []
        self.flights: list[tuple[str, int, int, int]] = []          # (sender, number, start_ns, end_ns)
        self.bounds_ns: list[int] = []
        links = Links(self.ledger, self._deliver, pipelines or {})
        self.radio = RecordingRadio(self.flights, RadioSettings(**settings), nodes, self.agenda, self.ledger, links,
                                    rng_for)

    def _deliver(self, receiver: str, medium: str, arrival_ns: int, data: bytes) -> bool:
        assert all(arrival_ns >= bound_ns for bound_ns in self.bounds_ns)
        self.heard.append((arrival_ns, receiver, data))
        return True

    def offer(self, at_ns: int, sender: str, size_bytes: int = 0) -> None:
        data = bytes(size_bytes)
        self.agenda.at(at_ns, OFFER, sender, partial(self.radio.offer, sender, data, at_ns))

    def run(self, offers: Iterable[tuple[int, str, int]] = (), until_ns: int = END_NS) -> Bench:
        for at_ns, sender, size_bytes in offers:
            self.offer(at_ns, sender, size_bytes)
        self.agenda.run_before(until_ns)
        self.radio.finish(until_ns)
        assert self.ledger.expected == sum(self.ledger.closed.values())
        return self

    def fate(self, sender: str, number: int, receiver: str) -> Fate:
        (fate,) = self.ledger.fates[sender, number, receiver]
        return fate


def graph(*links: str, **levels_dbm: float) -> FixedGraph:
    return FixedGraph(links=links, **levels_dbm)  # type: ignore[arg-type]


def csma(**figures: Any) -> CarrierSenseSettings:
    return CarrierSenseSettings(**figures)
