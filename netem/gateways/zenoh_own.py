"""What the programs at a Zenoh gateway have declared, with the numbers under which other nodes are told of it."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from netem.gateways.zenoh_endpoint import Declared
from netem.gateways.zenoh_others import answers
from netem.wire.zenoh_messages import Declare, Entity, Undeclare


class Own:
    """A queryable that has gone is kept for `lease_ns`, as others may still count on its answers."""

    def __init__(self, lease_ns: int) -> None:
        self._lease_ns = lease_ns
        self._numbers: dict[Declared, int] = {}
        self._given = 0
        self._gone: list[tuple[int, Declared]] = []         # (until when, former queryable)

    def __contains__(self, declared: object) -> bool:
        return declared in self._numbers

    def change(self, declared: Collection[Declared], now_ns: int) -> tuple[list[Declared], list[Undeclare]]:
        """Take what is declared now; return what is new, and the undeclarations of what is no more."""
        gone = [each for each in self._numbers if each not in declared]
        undeclared = [Undeclare(each.entity, self._numbers.pop(each)) for each in gone]
        self._gone = [(until_ns, each) for until_ns, each in self._gone if until_ns > now_ns]
        self._gone += [(now_ns + self._lease_ns, each) for each in gone if each.entity is Entity.QUERYABLE]
        new = sorted(each for each in declared if each not in self._numbers)
        for each in new:
            self._given += 1
            self._numbers[each] = self._given
        return new, undeclared

    def declaration(self, declared: Declared) -> Declare:
        return Declare(declared.entity, self._numbers[declared], declared.key, declared.complete)

    def declarations(self) -> list[Declare]:
        return [self.declaration(declared) for declared in self._numbers]

    def answers(self, key: str, *, only_complete: bool) -> bool:
        """Return whether a queryable takes a query with this key."""
        return any(self._taking(self._numbers, key, only_complete=only_complete))

    def has_answered(self, key: str, *, only_complete: bool, now_ns: int) -> bool:
        """Return whether a queryable that has gone would have taken such a query."""
        return any(self._taking([each for until_ns, each in self._gone if until_ns > now_ns], key,
                                only_complete=only_complete))

    @staticmethod
    def _taking(declared: Collection[Declared], key: str, *, only_complete: bool) -> Iterator[bool]:
        return (True for each in declared if each.entity is Entity.QUERYABLE
                and answers(each, key, only_complete=only_complete))
