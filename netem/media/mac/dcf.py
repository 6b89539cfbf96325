"""The distributed coordination function of IEEE 802.11-2016, 10.3.4, for broadcast: a back-off that counts idle slots.

    channel idle for wait_ns (DIFS) at the offer   ->   transmit at once
    otherwise draw r from 0 .. 2^min_exponent - 1 slots and count them down; counting starts when the channel has been
    idle for wait_ns, stops while it is busy, and resumes from there; at 0 the first bit is sent

A node decides turnaround_ns before its first bit and then no longer listens: two countdowns that end within it collide.
A broadcast is never repeated, so the contention window stays at its minimum and no frame is dropped after attempts.
Not modelled: back-off after a transmission by a node with nothing more to send, EIFS after a collision, RTS/CTS.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from netem.core.agenda import OFFER, TIMER
from netem.core.frame import Frame
from netem.media.mac import CarrierSense, Channel, StreamFor, draw_slots
from netem.media.mac.listening_stations import ListeningStations, Station


@dataclass
class CountingStation(Station):
    slots: int = 0                      # idle slots that remain to be counted
    decided: bool = False               # true between the decision and the first bit
    countdown: int = 0                  # number of the current countdown; timers of earlier ones have no effect


class Dcf(ListeningStations[CountingStation]):
    def __init__(self, channel: Channel, queue_frames: int, sense: CarrierSense, rng_for: StreamFor) -> None:
        super().__init__(CountingStation, channel, queue_frames, sense, rng_for)
        self.min_wait_ns = sense.turnaround_ns

    def heard(self, node: str, now_ns: int) -> None:
        station = self._station(node)
        if station.frame is not None and not station.decided:
            counting_since_ns = station.silent_since_ns + self._sense.wait_ns
            elapsed = max(0, now_ns - counting_since_ns) // self._sense.slot_ns
            station.slots -= min(elapsed, station.slots)
            station.countdown += 1

    def cleared(self, node: str, now_ns: int) -> None:
        station = self._station(node)
        station.silent_since_ns = now_ns
        if station.frame is not None and not station.decided:
            self._count_down(station, station.frame, now_ns)

    def _begin(self, station: CountingStation, frame: Frame, now_ns: int) -> None:
        sense = self._sense
        station.frame = frame
        silent = not self._channel.carriers(frame.sender)
        if silent and station.silent_since_ns + sense.wait_ns <= now_ns:
            self._talk(station, frame, station.countdown, now_ns + sense.turnaround_ns)
            return
        station.slots = draw_slots(station.rng, sense.min_exponent)
        if silent:
            self._count_down(station, frame, now_ns)

    def _count_down(self, station: CountingStation, frame: Frame, now_ns: int) -> None:
        sense = self._sense
        first_bit_ns = station.silent_since_ns + sense.wait_ns + station.slots * sense.slot_ns
        decide_ns = max(now_ns, first_bit_ns - sense.turnaround_ns)
        station.countdown += 1
        self._channel.agenda.at(decide_ns, TIMER, frame.sender, partial(
            self._talk, station, frame, station.countdown, decide_ns + sense.turnaround_ns))

    def _talk(self, station: CountingStation, frame: Frame, countdown: int, start_ns: int) -> None:
        if station.countdown == countdown and station.frame is frame:
            station.decided = True
            self._channel.agenda.at(start_ns, OFFER, frame.sender, partial(self._start, station, frame, start_ns))

    def _start(self, station: CountingStation, frame: Frame, now_ns: int) -> None:
        station.frame, station.decided = None, False
        self._channel.start(frame, now_ns)
