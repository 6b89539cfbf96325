"""A graph that follows its nodes: links from the position that each node showed last.

    frame starts at t          position of a body = that at floor(t / period) period, the last one shown at or before t

Bodies show their positions at 0, period, 2 period, ... of true time; nobody steps a plant back. Between two of these
instants a body moves by less than speed x period, so with speeds v1 and v2 at the ends of a link the distance that
decides is wrong by less than (v1 + v2) period, and the instant at which a link appears or disappears is at most one
period late.

Invariants:
- a question is about the present: all positions at or before its instant have been shown, none after it;
- a node that has shown no position yet reaches nobody and is reached by nobody.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from netem.topology import Edge, Position
from netem.topology.reach import Reach

NOWHERE = Reach((), frozenset(), frozenset(), {})


class MovingGraph:
    """`at_m` has the positions of the nodes that do not move; `reach_of` computes a sender's reach from positions."""

    moves = True

    def __init__(self, nodes: Sequence[str], at_m: Mapping[str, Position],
                 reach_of: Callable[[str, dict[str, Position]], Reach], propagates: bool = False) -> None:
        self._nodes = tuple(nodes)
        self._at_m = dict(at_m)
        self._reach_of = reach_of
        self.propagates = propagates
        self._reached: dict[str, Reach] = {}        # by sender, since a node last moved
        self._shown_ns = 0

    def show(self, node: str, at_m: Position, t_ns: int) -> None:
        self._shown_ns = t_ns
        if self._at_m.get(node) != at_m:
            self._at_m[node] = at_m
            self._reached.clear()

    def position(self, node: str, t_ns: int) -> Position | None:
        return self._at_m.get(node)

    def reach_at(self, sender: str, t_ns: int) -> Reach:
        assert t_ns >= self._shown_ns, f"the graph at {t_ns} ns is asked for after a node moved at {self._shown_ns} ns"
        found = self._reached.get(sender)
        if found is None:
            found = self._reached[sender] = (self._reach_of(sender, self._at_m) if sender in self._at_m else NOWHERE)
        return found

    def graph_at(self, t_ns: int) -> list[Edge]:
        return [(sender, receiver) for sender in self._nodes for receiver in self._nodes if sender != receiver]

    def changes_ns(self, until_ns: int) -> list[int]:
        return []
