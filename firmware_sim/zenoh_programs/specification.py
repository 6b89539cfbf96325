"""What a program's Zenoh needs to know of the scenario: its address, and which medium carries which keys."""

from __future__ import annotations

import msgspec


class ZenohMedium(msgspec.Struct, frozen=True):
    """A medium that carries a node's Zenoh frames."""

    name: str
    longest_bytes: int | None           # of a frame, None: no limit
    addressed: bool                     # True: its ports take datagrams with the name of a node as destination


class ZenohSpecification(msgspec.Struct, frozen=True):
    """`ways`: (key expression, medium), the first that intersects a key carries its messages."""

    names: tuple[str, ...]              # of all nodes; the address of a node is its place here, from 1 on
    media: tuple[ZenohMedium, ...]
    ways: tuple[tuple[str, str], ...]
    problem: str = ""                   # why this node cannot open a session, "" if it can
