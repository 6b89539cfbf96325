"""A graph that follows its nodes: links from the position that each node showed last.

    frame starts at t          position of a body = that at floor(t / period) period, the last one shown at or before t

Bodies show their positions at 0, period, 2 period, ... of true time; nobody steps a plant back. Between two of these
instants a body moves by less than speed x period, so with speeds v1 and v2 at the ends of a link the distance that
decides is wrong by less than (v1 + v2) period, and the instant at which a link appears or disappears is at most one
period late.

Invariants:
- a question is about the present: all positions at or before its instant have been shown, none after it;
- a node that has shown no position yet reaches nobody and is reached by nobody;
- while each node is less than `_free_m` from where it was at the last comparison, no link has changed since: both ends
  together have then moved by less than any distance differed from the range.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from math import dist, inf

from netem.topology import Edge, Position
from netem.topology.reach import Reach

ROUNDING_M = 1e-6           # more than rounding of levels and distances can come to
NOWHERE = Reach((), frozenset(), frozenset(), {})


class MovingGraph:
    """`at_m` has the positions of the nodes that do not move; `reach_of` computes a sender's reach from positions.

    `range_m` is the distance up to which two nodes hear each other, if nothing but the distance decides.
    """

    moves = True

    def __init__(self, nodes: Sequence[str], at_m: Mapping[str, Position],
                 reach_of: Callable[[str, dict[str, Position]], Reach], propagates: bool = False,
                 range_m: float | None = None) -> None:
        self._nodes = tuple(nodes)
        self._at_m = dict(at_m)
        self._reach_of = reach_of
        self.propagates = propagates
        self._reached: dict[str, Reach] = {}        # by sender, since a node last moved
        self._shown_ns = 0
        self._range_m = range_m
        self._in_range: dict[str, frozenset[str]] = {}      # by sender, at the last comparison
        self._compared_m: dict[str, Position] = {}          # positions at the last comparison
        self._free_m = 0.0
        self._changes_ns: list[int] = []

    def show(self, node: str, at_m: Position, t_ns: int) -> bool:
        self._shown_ns = t_ns
        if self._at_m.get(node) == at_m:
            return False
        self._at_m[node] = at_m
        self._reached.clear()
        before = self._compared_m.get(node)
        return before is None or dist(before, at_m) >= self._free_m

    def compare(self, t_ns: int) -> tuple[list[Edge], list[Edge]]:
        appeared: list[Edge] = []
        disappeared: list[Edge] = []
        for sender in self._nodes:
            now, before = self.reach_at(sender, t_ns).in_range, self._in_range.get(sender, frozenset())
            if now != before:
                self._in_range[sender] = now
                appeared += [(sender, node) for node in self._nodes if node in now and node not in before]
                disappeared += [(sender, node) for node in self._nodes if node in before and node not in now]
        if t_ns > 0 and (appeared or disappeared):
            self._changes_ns.append(t_ns)
        if self._range_m is not None:
            self._compared_m = dict(self._at_m)
            closest_m = min((abs(dist(one, other) - self._range_m) for one, other in combinations(
                self._compared_m.values(), 2)), default=inf)
            self._free_m = closest_m / 2 - ROUNDING_M
        return appeared, disappeared

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
        return [t_ns for t_ns in self._changes_ns if t_ns < until_ns]
