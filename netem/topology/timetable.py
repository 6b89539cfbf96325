"""Graphs by time: graph i holds on [starts_ns[i], starts_ns[i+1]), the last one to the end of the run or period.

With `repeat_ns` the list starts again at every multiple of it. A medium looks its graph up at the start of a frame, so
a change does not affect a frame that is on the air.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from typing import ClassVar

from netem.topology import Edge, Graph, Position
from netem.topology.reach import Reach
from netem.wire.instants import NEVER_NS


class Timetable:
    moves: ClassVar[bool] = False

    def __init__(self, starts_ns: Sequence[int], graphs: Sequence[Graph], repeat_ns: int | None = None,
                 propagates: bool = False, at_m: Mapping[str, Position] | None = None) -> None:
        assert len(starts_ns) == len(graphs)
        assert starts_ns[0] == 0
        self._starts_ns = tuple(starts_ns)
        self._graphs = tuple(graphs)
        self._repeat_ns = repeat_ns
        self._at_m = dict(at_m or {})
        self.propagates = propagates
        self._from_ns, self._until_ns, self._graph = self._row(0)

    def show(self, node: str, at_m: Position, t_ns: int) -> bool:
        raise NotImplementedError

    def compare(self, t_ns: int) -> tuple[list[Edge], list[Edge]]:
        raise NotImplementedError

    def reach_at(self, sender: str, t_ns: int) -> Reach:
        if not self._from_ns <= t_ns < self._until_ns:
            self._from_ns, self._until_ns, self._graph = self._row(t_ns)
        return self._graph[sender]

    def graph_at(self, t_ns: int) -> list[Edge]:
        graph = self._row(t_ns)[2]
        return [(sender, receiver) for sender, reach in graph.items() for receiver in reach.receivers
                if receiver in reach.in_range]

    def position(self, node: str, t_ns: int) -> Position | None:
        return self._at_m.get(node)

    def changes_ns(self, until_ns: int) -> list[int]:
        changes: list[int] = []
        _, at_ns, graph = self._row(0)
        while at_ns < min(until_ns, NEVER_NS):
            _, next_ns, following = self._row(at_ns)
            if following is not graph:
                changes.append(at_ns)
            at_ns, graph = next_ns, following
        return changes

    def _row(self, t_ns: int) -> tuple[int, int, Graph]:
        """(start_ns, end_ns, graph) of the row that holds at `t_ns`; the end is exclusive."""
        cycle_ns = 0 if self._repeat_ns is None else t_ns // self._repeat_ns * self._repeat_ns
        row = bisect_right(self._starts_ns, t_ns - cycle_ns) - 1
        if row + 1 < len(self._starts_ns):
            until_ns = cycle_ns + self._starts_ns[row + 1]
        else:
            until_ns = NEVER_NS if self._repeat_ns is None else cycle_ns + self._repeat_ns
        return cycle_ns + self._starts_ns[row], until_ns, self._graphs[row]
