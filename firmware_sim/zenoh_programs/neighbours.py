"""What other nodes have declared, as far as this node has heard it.

A declaration holds for `lease_ns` from each time that it is heard, and ends with its undeclaration. So what a node has
declared is forgotten when the node is out of range for that long, and comes back with the next repetition.

Invariant: one entry for each (address, entity, number); a declaration of another key under them replaces the entry.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from firmware_sim.zenoh_programs.real import KeyExpr
from netem.wire.zenoh_messages import Declare, Entity, Undeclare


@dataclass(eq=False)
class Known:
    """An entity of another node."""

    address: int
    entity: Entity
    number: int
    key: KeyExpr
    text: str
    complete: bool
    until_ns: dict[str, int] = field(default_factory=dict)      # by medium: how long it holds there


class Neighbours:
    """`appeared` and `vanished` are called with each entity that becomes known or is forgotten."""

    def __init__(self, lease_ns: int, at: Callable[[int, Callable[[], None]], None], now_ns: Callable[[], int],
                 appeared: Callable[[Known], None], vanished: Callable[[Known], None]) -> None:
        self._lease_ns = lease_ns
        self._at = at                   # at(delay_ns, action)
        self._now_ns = now_ns
        self._appeared, self._vanished = appeared, vanished
        self._known: dict[tuple[int, Entity, int], Known] = {}

    def declare(self, medium: str, address: int, message: Declare) -> None:
        place = (address, message.entity, message.number)
        known = self._known.get(place)
        if known is not None and (known.text, known.complete) != (message.key, message.complete):
            self._forget(place)
            known = None
        if known is None:
            known = Known(address, message.entity, message.number, KeyExpr(message.key), message.key,
                          message.complete)
            self._known[place] = known
            known.until_ns[medium] = self._now_ns() + self._lease_ns
            self._at(self._lease_ns, lambda: self._check(place, known))
            self._appeared(known)
        known.until_ns[medium] = self._now_ns() + self._lease_ns

    def undeclare(self, address: int, message: Undeclare) -> None:
        self._forget((address, message.entity, message.number))

    def those(self, entity: Entity) -> Iterator[Known]:
        """Return the known entities of one kind, in the order in which they became known."""
        return iter([known for known in self._known.values() if known.entity is entity])

    def addresses(self) -> list[int]:
        return list(dict.fromkeys(known.address for known in self._known.values()))

    def _check(self, place: tuple[int, Entity, int], known: Known) -> None:
        """Forget the entity if it has not been heard for its lease; look again when it could be."""
        if self._known.get(place) is not known:
            return
        now_ns = self._now_ns()
        for medium in [medium for medium, until_ns in known.until_ns.items() if until_ns <= now_ns]:
            del known.until_ns[medium]
        if known.until_ns:
            self._at(max(known.until_ns.values()) - now_ns, lambda: self._check(place, known))
        else:
            self._forget(place)

    def _forget(self, place: tuple[int, Entity, int]) -> None:
        known = self._known.pop(place, None)
        if known is not None:
            self._vanished(known)
