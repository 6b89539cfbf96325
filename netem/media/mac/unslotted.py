"""Unslotted CSMA-CA as in IEEE 802.15.4-2011, 5.1.1.4: back off, assess the channel, then transmit or back off again.

    back-off: wait_ns + r slots, r from 0 .. 2^BE - 1     ->  listen for cca_ns
    idle all the time    ->  first bit turnaround_ns later
    busy at any time     ->  BE + 1 up to max_exponent, back-off again; the max_attempts-th time: `Fate.CHANNEL_BUSY`

The back-off goes on while others transmit. A frame that starts at the instant at which listening ends is not detected.
Not modelled: acknowledgement (a broadcast has none), battery life extension, beacons.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from netem.core.agenda import OFFER, TIMER
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.media.mac import CarrierSense, Channel, StreamFor, draw_slots
from netem.media.mac.listening_stations import ListeningStations, Station


@dataclass
class RetryingStation(Station):
    attempts: int = 0
    exponent: int = 0


class Unslotted(ListeningStations[RetryingStation]):
    def __init__(self, channel: Channel, queue_frames: int, sense: CarrierSense, rng_for: StreamFor) -> None:
        super().__init__(RetryingStation, channel, queue_frames, sense, rng_for)
        self.min_wait_ns = sense.wait_ns + sense.cca_ns + sense.turnaround_ns

    def heard(self, node: str, now_ns: int) -> None: ...

    def cleared(self, node: str, now_ns: int) -> None:
        self._station(node).silent_since_ns = now_ns

    def _begin(self, station: RetryingStation, frame: Frame, now_ns: int) -> None:
        station.frame, station.attempts, station.exponent = frame, 0, self._sense.min_exponent
        self._back_off(station, frame, now_ns)

    def _back_off(self, station: RetryingStation, frame: Frame, now_ns: int) -> None:
        sense = self._sense
        decide_ns = now_ns + sense.wait_ns + draw_slots(station.rng, station.exponent) * sense.slot_ns + sense.cca_ns
        self._channel.agenda.at(decide_ns, TIMER, frame.sender, partial(self._decide, station, frame, decide_ns))

    def _decide(self, station: RetryingStation, frame: Frame, now_ns: int) -> None:
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

    def _start(self, station: RetryingStation, frame: Frame, now_ns: int) -> None:
        station.frame = None
        self._channel.start(frame, now_ns)
