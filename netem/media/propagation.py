"""Propagation on a radio channel: a frame reaches each node after the time that its way takes.

    on the air at the sender: [start, end)       at a node that is `delay` away: [start + delay, end + delay)

Overlap, deafness and carrier sense are those at the receiver, so two frames that follow one another without a gap can
collide at a node that the second one reaches sooner, and overlapping ones can miss one another.

Invariants:
- `_due_ns` holds the instant of every reception that has not been decided; receptions are decided in its order;
- only flights in `_undecided` have rivals, so that no cycle of flights is left;
- `_near` holds every flight that a frame starting now can overlap somewhere: those with now < end + longest delay.
"""

from __future__ import annotations

from functools import partial
from heapq import heappop, heappush
from typing import Protocol

from netem.core.agenda import END_OF_FRAME, OFFER, Agenda
from netem.media.decoding.on_air import OnAir


class Receivers(Protocol):
    """What a radio does when something of a flight reaches a node."""

    def receive(self, flight: OnAir, receiver: str, now_ns: int) -> None:
        """Decide one copy: the last bit of `flight`, in the receiver's times, has reached `receiver`."""

    def carrier_begins(self, node: str, now_ns: int) -> None: ...

    def carrier_ends(self, node: str, now_ns: int) -> None: ...


class Propagation:
    """Carries the flights of a radio whose topology has propagation times."""

    def __init__(self, radio: Receivers, agenda: Agenda) -> None:
        self._radio = radio
        self._agenda = agenda
        self._due_ns: list[int] = []                        # a heap
        self._near: list[OnAir] = []
        self._undecided: dict[OnAir, dict[str, None]] = {}  # receivers, by flight

    def start(self, flight: OnAir, *, overlaps: bool, sensed: bool) -> None:
        """Schedule the receptions of a flight that starts now; `overlaps` and `sensed` say whether those matter."""
        now_ns, sender = flight.start_ns, flight.sender
        if overlaps and flight.end_ns > now_ns:
            self._near = [other for other in self._near if now_ns < other.end_ns + _longest_ns(other)]
            for other in self._near:
                if other.sender != sender:      # frames of one sender come in turn, also while it approaches
                    if flight.reach.receivers:
                        flight.rivals.append(other)
                    if other in self._undecided:
                        other.rivals.append(flight)
            self._near.append(flight)
        if flight.reach.receivers:
            self._undecided[flight] = dict.fromkeys(flight.reach.receivers)
        for receiver in flight.reach.receivers:
            at_ns = flight.end_ns + flight.reach.delays_ns[receiver]
            heappush(self._due_ns, at_ns)
            self._agenda.at(at_ns, END_OF_FRAME, sender, partial(self._receive, flight, receiver, at_ns))
        if sensed and flight.end_ns > now_ns:
            for node in flight.reach.receivers:
                if node in flight.reach.in_range:
                    delay_ns = flight.reach.delays_ns[node]
                    begins_ns, ends_ns = now_ns + delay_ns, flight.end_ns + delay_ns
                    self._agenda.at(begins_ns, OFFER, sender, partial(self._radio.carrier_begins, node, begins_ns))
                    self._agenda.at(ends_ns, END_OF_FRAME, sender, partial(self._radio.carrier_ends, node, ends_ns))

    def next_ns(self, never_ns: int) -> int:
        """Return the instant of the next reception of a frame that has started, `never_ns` if there is none."""
        return self._due_ns[0] if self._due_ns else never_ns

    def undecided(self) -> list[tuple[OnAir, str]]:
        """Return the (flight, receiver) of each reception that has not been decided."""
        return [(flight, receiver) for flight, receivers in self._undecided.items() for receiver in receivers]

    def _receive(self, flight: OnAir, receiver: str, now_ns: int) -> None:
        heappop(self._due_ns)
        waiting = self._undecided[flight]
        del waiting[receiver]
        self._radio.receive(_seen_from(flight, receiver), receiver, now_ns)
        if not waiting:
            del self._undecided[flight]
            flight.rivals.clear()       # two frames that overlap name each other: a cycle that outlives both


def _longest_ns(flight: OnAir) -> int:
    return max(flight.reach.delays_ns.values(), default=0)


def _seen_from(flight: OnAir, receiver: str) -> OnAir:
    """Return the flight with the times at which it reaches the receiver, and those rivals that overlap it there."""
    seen = _shifted(flight, receiver)
    for rival in flight.rivals:
        there = _shifted(rival, receiver)
        if there.start_ns < seen.end_ns and seen.start_ns < there.end_ns:
            seen.rivals.append(there)
    return seen


def _shifted(flight: OnAir, receiver: str) -> OnAir:
    delay_ns = flight.reach.delays_ns.get(receiver, 0)      # 0: the receiver sends it itself, or gets no power of it
    return OnAir(flight.sender, flight.frame, flight.reach, flight.start_ns + delay_ns, flight.end_ns + delay_ns)
