"""Events of a run besides frame copies, such as broken promises, the end of a node, a new topology.

Nodes send events in reports. Reports of different nodes arrive in an order that differs between hosts and runs, while
the events of one node keep their order. The log is therefore ordered by (time, node, order of arrival), and so is the
hash. Two runs are equal if the hashes of their events and of their ledgers are.

An event about the wall clock (a late node, an overrun) is recorded and shown but marked `wall_clock` and not hashed.
"""

from __future__ import annotations

from collections.abc import Iterable
from hashlib import blake2b
from typing import NamedTuple

import msgspec

from netem.wire.level import Level


class Event(NamedTuple):
    time_ns: int
    node: str                   # "" for the emulator itself
    kind: str
    detail: str
    level: Level = Level.INFO
    wall_clock: bool = False


def in_order(events: Iterable[Event]) -> list[Event]:
    """Return the events by (time, node); events of one node at one instant keep their order."""
    return sorted(events, key=lambda event: (event.time_ns, event.node))


def hash_of_events(events: Iterable[Event]) -> str:
    """Return the BLAKE2b hash of the ordered events without `wall_clock`, each as a MessagePack array."""
    encoder = msgspec.msgpack.Encoder()
    total = blake2b(digest_size=16)
    for event in in_order(events):
        if not event.wall_clock:
            total.update(encoder.encode((event.time_ns, event.node, event.kind, event.detail, int(event.level))))
    return total.hexdigest()
