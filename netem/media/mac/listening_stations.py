"""The part that both carrier sense schemes share: for each node one frame in service, and a queue behind it.

Invariants: a frame is in service, queued, or passed to the channel, never two of these; a queue holds at most
`queue_frames`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from random import Random
from typing import Generic, TypeVar

from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.media.mac import CarrierSense, Channel, StreamFor

LONG_AGO_NS = -(1 << 62)


@dataclass
class Station:
    rng: Random
    frame: Frame | None = None          # the frame in service, not yet on the air
    silent_since_ns: int = LONG_AGO_NS
    queue: deque[Frame] = field(default_factory=deque)


AnyStation = TypeVar("AnyStation", bound=Station)


class ListeningStations(ABC, Generic[AnyStation]):
    """Base class of the schemes, which implement the back-off; `kind` is their class of stations."""

    senses = True

    def __init__(self, kind: type[AnyStation], channel: Channel, queue_frames: int, sense: CarrierSense,
                 rng_for: StreamFor) -> None:
        self._kind = kind
        self._channel = channel
        self._queue_frames = queue_frames
        self._sense = sense
        self._rng_for = rng_for
        self._stations: dict[str, AnyStation] = {}

    def submit(self, frame: Frame, now_ns: int) -> None:
        station = self._station(frame.sender)
        if station.frame is None and not station.queue and not self._channel.transmitting(frame.sender):
            self._begin(station, frame, now_ns)
        elif len(station.queue) >= self._queue_frames:
            self._channel.drop(frame, Fate.QUEUE_FULL, "csma")
        else:
            station.queue.append(frame)

    def sent(self, node: str, now_ns: int) -> None:
        self._serve_next(self._stations[node], now_ns)

    def waiting(self) -> Iterable[Frame]:
        return [frame for station in self._stations.values()
                for frame in (station.frame, *station.queue) if frame is not None]

    def _station(self, node: str) -> AnyStation:
        station = self._stations.get(node)
        if station is None:
            station = self._stations[node] = self._kind(self._rng_for(node))
        return station

    def _serve_next(self, station: AnyStation, now_ns: int) -> None:
        if station.queue:
            self._begin(station, station.queue.popleft(), now_ns)

    @abstractmethod
    def _begin(self, station: AnyStation, frame: Frame, now_ns: int) -> None:
        """Take `frame` into service: start its back-off."""
