"""A medium that the house does not have: each node's frames go to the next one, around a ring."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from random import Random
from typing import ClassVar

from netem.core.agenda import Agenda
from netem.core.frame import Frame
from netem.media import MediumSettings
from netem.media.links import Links
from netem.media.medium import Medium
from netem.media.observation import MediumObserver
from netem.records import Feed, Place, Recorder
from netem.records.events import Event
from netem.records.ledger import Ledger


@dataclass(frozen=True)
class RingLogSettings:
    ring: str


@dataclass(frozen=True)
class RingSettings(MediumSettings):
    latency_ns: int

    def recorders(self, medium: str) -> Mapping[str, object]:
        return {"ring_log": RingLogSettings(medium)}


class Ring(Medium):
    Settings: ClassVar = RingSettings
    signals: ClassVar = (("bytes", "1"),)

    def __init__(self, name: str, settings: RingSettings, nodes: Iterable[str], agenda: Agenda, ledger: Ledger,
                 links: Links, rng_for: Callable[[str], Random]) -> None:
        super().__init__(name, nodes)
        self._latency_ns, self._ledger, self._links = settings.latency_ns, ledger, links
        self._next = dict(pairwise((*self.nodes, self.nodes[0])))
        self._sent: Counter[str] = Counter()
        self._observer = MediumObserver()

    def offer(self, sender: str, data: bytes, now_ns: int) -> None:
        receiver, arrival_ns = self._next[sender], now_ns + self._latency_ns
        frame = Frame(self.name, sender, self._sent[sender], now_ns, data, now_ns, arrival_ns)
        self._sent[sender] += 1
        self._ledger.expect(1, self.name)
        self._links.receive(frame, receiver, arrival_ns, checksum=True)
        self._observer.sample(self.name, now_ns, [float(len(data))])
        self._observer.event(Event(now_ns, sender, "handed on", f"to {receiver}"))
        for tap in self.taps:
            tap.frame(frame, arrival_ns)

    def lookahead_ns(self, t0_ns: int) -> int:
        return t0_ns + self._latency_ns

    def finish(self, end_ns: int) -> None:
        """The links know every copy from the start."""

    def links(self, until_ns: int) -> Sequence[tuple[str, str]]:
        return list(self._next.items())

    def observe(self, observer: MediumObserver) -> None:
        self._observer = observer

    def counters(self) -> Mapping[str, Mapping[str, int]]:
        return {self.name: {"frames": self._sent.total()}}


class RingLog(Recorder):
    """The recorder that a ring asks for."""

    Settings = RingLogSettings
    FILES = ("{medium}.txt",)

    def __init__(self, settings: RingLogSettings, place: Place) -> None:
        super().__init__(settings, place)
        self._lines: list[str] = []

    def record(self, run: Feed) -> None:
        run.frames[self.settings.ring].append(self)

    def frame(self, frame: Frame, seen_ns: int) -> None:
        self._lines.append(f"{frame.on_air_ns} {frame.sender} {frame.data.decode()}\n")

    def error_frame(self, medium: str, time_ns: int) -> None:
        """There are none."""

    def finish(self) -> None:
        (self.place.folder / f"{self.settings.ring}.txt").write_text("".join(self._lines))
