"""What the other nodes of a medium have declared, as far as a Zenoh gateway has heard it, and its mirrors of that.

    declaration of a node --lease_ns from each time it is heard--> forgotten        undeclaration --> forgotten
    one mirror for each (entity, key, complete) that some node has declared

A put that several mirrors take goes out once: the first mirror whose key intersects that of the put counts. Of the
mirrors that take a query, the first complete one that has all of its keys counts, else the first that intersects it:
the library offers a query for complete answers to such mirrors only, and any other query to these too.

Invariant: a mirror counts from the instant at which the session has declared it (`confirm`) until it is to withdraw it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import dataclass

from netem.gateways.zenoh_endpoint import Declared, includes, intersects
from netem.wire.instants import NEVER_NS
from netem.wire.zenoh_messages import Declare, Entity, Undeclare

MOST_DECLARED = 10_000          # of all nodes together; further declarations are not taken


@dataclass
class Known:
    declared: Declared
    until_ns: int


class Others:
    """`mirror` and `unmirror` are called with what the session has to declare and to withdraw."""

    def __init__(self, lease_ns: int, mirror: Callable[[Declared], None], unmirror: Callable[[Declared], None]) -> None:
        self._lease_ns = lease_ns
        self._mirror, self._unmirror = mirror, unmirror
        self._known: dict[tuple[int, Entity, int], Known] = {}
        self._holders: Counter[Declared] = Counter()        # nodes' declarations for each mirror
        self._confirmed: dict[Declared, None] = {}          # in the order in which the session declared them
        self._first: dict[tuple[Entity, str], Declared | None] = {}     # the mirror that counts, by key
        self._expires_ns = NEVER_NS                         # no declaration ends before it

    # --- what nodes say

    def declare(self, address: int, message: Declare, now_ns: int) -> None:
        place = (address, message.entity, message.number)
        declared = Declared(message.entity, message.key, message.complete)
        known = self._known.get(place)
        if known is not None and known.declared == declared:
            known.until_ns = now_ns + self._lease_ns
            return
        if known is None and len(self._known) >= MOST_DECLARED:
            return
        self._forget(place)
        self._known[place] = Known(declared, now_ns + self._lease_ns)
        self._expires_ns = min(self._expires_ns, now_ns + self._lease_ns)
        self._holders[declared] += 1
        if self._holders[declared] == 1:
            self._mirror(declared)

    def undeclare(self, address: int, message: Undeclare) -> None:
        self._forget((address, message.entity, message.number))

    def due_ns(self) -> int:
        """Return an instant before which no declaration ends for silence."""
        return self._expires_ns

    def expire(self, now_ns: int) -> None:
        if now_ns < self._expires_ns:
            return
        for place in [place for place, known in self._known.items() if known.until_ns <= now_ns]:
            self._forget(place)
        self._expires_ns = min((known.until_ns for known in self._known.values()), default=NEVER_NS)

    # --- what the gateway asks

    def confirm(self, mirror: Declared) -> None:
        """Note that the session has declared a mirror."""
        if mirror in self._holders:
            self._confirmed[mirror] = None
            self._first.clear()

    def counts(self, mirror: Declared, key: str) -> bool:
        """Return whether a message with this key, which `mirror` has taken, is to go out on its behalf."""
        place = (mirror.entity, key)
        if place not in self._first:
            if len(self._first) >= MOST_DECLARED:
                self._first.clear()
            self._first[place] = self._first_of(*place)
        return self._first[place] == mirror

    def answerers(self, key: str, *, complete: bool) -> Collection[int]:
        """Return the addresses of the nodes with a queryable for `key`; `complete`: for all of its keys, completely."""
        return {address: None for (address, entity, _), known in self._known.items() if entity is Entity.QUERYABLE
                and answers(known.declared, key, only_complete=complete)}.keys()

    def _first_of(self, entity: Entity, key: str) -> Declared | None:
        those = [mirror for mirror in self._confirmed if mirror.entity is entity and intersects(mirror.key, key)]
        complete = (mirror for mirror in those if mirror.complete and includes(mirror.key, key))
        return next(complete, those[0] if those else None)

    def _forget(self, place: tuple[int, Entity, int]) -> None:
        known = self._known.pop(place, None)
        if known is None:
            return
        self._holders[known.declared] -= 1
        if not self._holders[known.declared]:
            del self._holders[known.declared]
            self._confirmed.pop(known.declared, None)
            self._first.clear()
            self._unmirror(known.declared)


def answers(queryable: Declared, key: str, *, only_complete: bool) -> bool:
    """Return whether a queryable takes a query; one for complete answers only if it has all keys of the query."""
    if only_complete:
        return queryable.complete and includes(queryable.key, key)
    return intersects(queryable.key, key)
