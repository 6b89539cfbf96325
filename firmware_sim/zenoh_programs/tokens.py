"""The liveliness tokens that this node knows, its own included; two of one key count as one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from firmware_sim.zenoh_programs.channels import Sink
from firmware_sim.zenoh_programs.real import KeyExpr
from firmware_sim.zenoh_programs.sample import Sample
from netem.wire.zenoh_messages import USUAL, Data


@dataclass(eq=False)
class Listener:
    """A liveliness subscriber."""

    key: KeyExpr
    sink: Sink


class Tokens:
    def __init__(self) -> None:
        self.listeners: list[Listener] = []
        self._alive: Counter[str] = Counter()

    def add(self, text: str, key: KeyExpr) -> None:
        self._alive[text] += 1
        if self._alive[text] == 1:
            self._tell(key, deletes=False)

    def remove(self, text: str, key: KeyExpr) -> None:
        self._alive[text] -= 1
        if not self._alive[text]:
            del self._alive[text]
            self._tell(key, deletes=True)

    def alive(self, key: KeyExpr) -> Iterator[Sample]:
        """Return a sample for each key with a token that intersects `key`."""
        return (sample_of(found) for found in map(KeyExpr, list(self._alive)) if found.intersects(key))

    def _tell(self, key: KeyExpr, *, deletes: bool) -> None:
        for listener in list(self.listeners):
            if listener.key.intersects(key):
                listener.sink.put(sample_of(key, deletes=deletes))


def sample_of(key: KeyExpr, *, deletes: bool = False) -> Sample:
    return Sample(key, Data(deletes=deletes), USUAL)
