"""Unslotted CSMA-CA as in IEEE 802.15.4-2011, 5.1.1.4: back off blindly, look once, then talk or try again.

    back-off: wait_ns + r slots, r from 0 .. 2^BE - 1     ->  listen for cca_ns
    silent all the time  ->  first bit turnaround_ns later
    busy at any time     ->  BE + 1 up to max_exponent, back-off again; the max_attempts-th time: `Fate.CHANNEL_BUSY`

The back-off is not frozen while others talk. A frame that starts at the very end of the listening is not noticed.
Not modelled: acknowledgement (a broadcast has none), battery life extension, beacons.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import partial
from random import Random

from netem.agenda import OFFER, TIMER
from netem.frames import Fate, Frame
from netem.media.mac import CarrierSense, Channel, StreamFor, draw_slots


@dataclass
class Station:
    rng: Random
    frame: Frame | None = None          # in service, not yet on the air
    attempts: int = 0
    exponent: int = 0
    silent_since_ns: int = 0
    queue: deque[Frame] = field(default_factory=deque)


class Unslotted:
    senses = True

    def __init__(self, channel: Channel, queue_frames: int, sense: CarrierSense, rng_for: StreamFor) -> None:
        self._channel = channel
        self._queue_frames = queue_frames
        self._sense = sense
        self._rng_for = rng_for
        self._stations: dict[str, Station] = {}
        self._waiting = 0
        self.min_wait_ns = sense.wait_ns + sense.cca_ns + sense.turnaround_ns

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

    def heard(self, node: str, now_ns: int) -> None: ...

    def cleared(self, node: str, now_ns: int) -> None:
        self._station(node).silent_since_ns = now_ns

    def waiting(self) -> Iterable[Frame]:
        return [frame for station in self._stations.values()
                for frame in (station.frame, *station.queue) if frame is not None]

    def _station(self, node: str) -> Station:
        station = self._stations.get(node)
        if station is None:
            station = self._stations[node] = Station(self._rng_for(node))
        return station

    def _serve_next(self, station: Station, now_ns: int) -> None:
        if station.queue:
            self._begin(station, station.queue.popleft(), now_ns)

    def _begin(self, station: Station, frame: Frame, now_ns: int) -> None:
        station.frame, station.attempts, station.exponent = frame, 0, self._sense.min_exponent
        self._back_off(station, frame, now_ns)

    def _back_off(self, station: Station, frame: Frame, now_ns: int) -> None:
        sense = self._sense
        decide_ns = now_ns + sense.wait_ns + draw_slots(station.rng, station.exponent) * sense.slot_ns + sense.cca_ns
        self._channel.agenda.at(decide_ns, TIMER, frame.sender, partial(self._decide, station, frame, decide_ns))

    def _decide(self, station: Station, frame: Frame, now_ns: int) -> None:
        sense = self._sense
        if not self._channel.carriers(frame.sender) and station.silent_since_ns <= now_ns - sense.cca_ns:
            start_ns = now_ns + sense.turnaround_ns
            self._channel.agenda.at(start_ns, OFFER, frame.sender, partial(self._start, station, frame, start_ns))
            return
        station.attempts += 1
        if station.attempts < sense.max_attempts:
            station.exponent = min(station.exponent + 1, sense.max_exponent)
            self._back_off(station, frame, now_ns)
        else:
            station.frame = None
            self._channel.drop(frame, Fate.CHANNEL_BUSY, "csma")
            self._serve_next(station, now_ns)

    def _start(self, station: Station, frame: Frame, now_ns: int) -> None:
        station.frame = None
        self._channel.start(frame, now_ns)
