"""Events of a run that are not frame copies: broken promises, nodes that end, topologies adopted.

They reach the emulator in reports, and the order in which reports arrive differs between hosts and runs. What does not
differ is the order in which one node tells its own events; so the log's order is (time, node, order of telling), and
the hash is taken over that order. It is apart from the ledger's: two runs are the same if both hashes are.

An event about the wall clock (a late node, an overrun) is kept and shown but marked `wall_clock` and not hashed.
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
    """By (time, node), events of one node at one instant as they were told."""
    return sorted(events, key=lambda event: (event.time_ns, event.node))


def hash_of_events(events: Iterable[Event]) -> str:
    """BLAKE2b over the ordered events of simulated time, each as a MessagePack array."""
    encoder = msgspec.msgpack.Encoder()
    total = blake2b(digest_size=16)
    for event in in_order(events):
        if not event.wall_clock:
            total.update(encoder.encode((event.time_ns, event.node, event.kind, event.detail, int(event.level))))
    return total.hexdigest()
