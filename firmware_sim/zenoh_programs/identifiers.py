"""Identifiers of nodes and their entities; a node has one for all sessions of its program, drawn from its name."""

from __future__ import annotations

from hashlib import blake2b

from firmware_sim.zenoh_programs.either import StandIn
from firmware_sim.zenoh_programs.real import MODULE


def identifier_of(name: str) -> bytes:
    """Return the 16 bytes that identify a node to others."""
    return blake2b(name.encode(), digest_size=16, person=b"marconet/zenoh").digest()


class ZenohId(StandIn):
    real = MODULE.ZenohId

    def __init__(self, identifier: bytes) -> None:
        self._identifier = identifier

    def __str__(self) -> str:
        return f"{int.from_bytes(self._identifier, 'little'):x}"

    __repr__ = __str__

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ZenohId) and str(self) == str(other)

    def __hash__(self) -> int:
        return hash(self._identifier)


class EntityGlobalId(StandIn):
    real = MODULE.EntityGlobalId

    def __init__(self, zid: ZenohId, eid: int) -> None:
        self.zid, self.eid = zid, eid

    def __repr__(self) -> str:
        return f"EntityGlobalId {{ zid: {self.zid}, eid: {self.eid} }}"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, EntityGlobalId) and (self.zid, self.eid) == (other.zid, other.eid)

    def __hash__(self) -> int:
        return hash((self.zid, self.eid))
