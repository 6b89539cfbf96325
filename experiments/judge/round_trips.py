"""Splits each round trip of a question about time over a gateway into the emulator's part and the part of the outside.

    asked inside:    total = media out + lateness + outside + media in
    asked outside:   total = media in + robots + lateness + media out          seen from the device

`media` is what the media took in virtual time, by the ledger. Lateness is what the emulator took besides: until a frame
that is due had left, and until a message that had come was on its medium. `outside` is the device, and the link to it.
A round trip whose frames are not in the ledger, or were not delivered, is left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import nan
from typing import NamedTuple

import numpy as np

from experiments.judge.groups import Ints
from experiments.judge.run_data import RunData
from netem.gateways.time_watch import Asker

NS_PER_S = 1_000_000_000


class RoundTrip(NamedTuple):
    """Durations in s of virtual time; `outside_s` is nan for a question from outside, which only its asker can time."""

    total_s: float
    media_s: float
    robots_s: float
    late_s: float
    outside_s: float


class RoundTrips(NamedTuple):
    """The median of each duration over the round trips of one gateway that `asker` began."""

    gateway: str
    asker: str                  # "inside", "outside"
    number: int
    median: RoundTrip


def round_trips(data: RunData) -> list[RoundTrips]:
    """Return the medians for each gateway and asker with at least one round trip."""
    found = []
    for gateway in sorted(data.scenario.get("gateways") or {}):
        table = data.signals.get(gateway)
        if table is None or "asked_by" not in table.names:
            continue
        columns = [np.round(table.sampled(name)[1] * scale).astype(np.int64) for name, scale in
                   (("asked_by", 1), ("due", NS_PER_S), ("sent", NS_PER_S), ("came", NS_PER_S), ("entered", 1))]
        ledger = _Passing(*(Columns(*map(copies.ints, Columns._fields)) for copies in (
            data.ledger.only(receiver=gateway), data.ledger.only(sender=gateway))))
        for asker in (Asker.INSIDE, Asker.OUTSIDE):
            trips = [trip for by, *told in zip(*columns, strict=True) if by == asker
                     for trip in _split(ledger, asker, *map(int, told))]
            if trips:
                found.append(RoundTrips(gateway, asker.name.lower(), len(trips), RoundTrip(
                    *(float(np.median(values)) for values in zip(*trips, strict=True)))))
    return found


class Columns(NamedTuple):
    """Frame copies, by the number of the frame at its sender; those that were not delivered have a negative instant."""

    number: Ints
    offered_ns: Ints
    delivered_ns: Ints


class _Passing(NamedTuple):
    """The copies that reached a gateway, and those of its own frames."""

    out: Columns
    into: Columns


def _split(ledger: _Passing, asker: Asker, due_ns: int, sent_ns: int, came_ns: int,
           number: int) -> Iterator[RoundTrip]:
    """Yield the round trip, or nothing if one of its two frames is not known."""
    out, into = ledger
    left = np.flatnonzero(out.delivered_ns == due_ns)
    entered = np.flatnonzero((into.number == number) & (into.delivered_ns >= 0))
    if not left.size or not entered.size:
        return
    first = entered[np.argmin(into.delivered_ns[entered])]
    offered_ns, arrived_ns = int(into.offered_ns[first]), int(into.delivered_ns[first])
    out_ns, late_ns = due_ns - int(out.offered_ns[left[0]]), sent_ns - due_ns + offered_ns - came_ns
    media_ns = out_ns + arrived_ns - offered_ns
    if asker is Asker.INSIDE:
        outside_ns = came_ns - sent_ns
        yield RoundTrip((media_ns + late_ns + outside_ns) / NS_PER_S, media_ns / NS_PER_S, 0.0, late_ns / NS_PER_S,
                        outside_ns / NS_PER_S)
    else:
        robots_ns = due_ns - out_ns - arrived_ns
        yield RoundTrip((sent_ns - came_ns) / NS_PER_S, media_ns / NS_PER_S, robots_ns / NS_PER_S, late_ns / NS_PER_S,
                        nan)
