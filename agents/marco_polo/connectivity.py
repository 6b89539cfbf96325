"""The connectivity graph of free cells, and shortest routes on it by A* (section 2.2.2).

Nodes are free cells, edges join the 8 neighbours, and the length of an edge is the distance of the centroids. A
diagonal edge needs both cells beside it to be free, since the platform's square passes over both. The heuristic of A*
is the octile distance, the length of the shortest route without obstacles.

`best_route` searches for the best of several goals at once: the graph gets a node behind all goals, an edge from each
goal to it costs what the goal gains less than the best one, and A* finds the route whose gain minus cost is greatest.

Source: dissertation, section 2.2.2 ("we use the graph searching algorithm A*"); Hart, Nilsson, Raphael 1968.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise
from math import fsum, sqrt
from typing import Any, NamedTuple

import networkx as nx
import numpy as np
from scipy.ndimage import label

from agents.marco_polo.cells import Cells, Mask
from agents.pursuit import Place

BEHIND = -1                     # the node behind all goals


class Route(NamedTuple):
    cells: list[int]            # from the start to the goal, both included
    length_m: float


class ConnectivityGraph:
    """The free cells of one sensor and their neighbours. Make a new one when obstacles move; that costs little."""

    def __init__(self, cells: Cells, free: Mask) -> None:
        """`free` has shape (rows * columns,); ValueError for any other."""
        if free.shape != (cells.rows * cells.columns,):
            raise ValueError(f"free cells of shape {free.shape}: expected {(cells.rows * cells.columns,)}")
        self.cells = cells
        self.free = free
        self._is_free: list[bool] = free.tolist()
        self._graph = _all_cells(cells)

    def _length_m(self, here: int, there: int, edge: Mapping[str, Any]) -> float | None:
        """Return the length of an edge of the graph of all cells; None, which hides it, if it is not free."""
        length_m: float = edge["weight"]
        if BEHIND in (here, there):
            return length_m
        free, columns = self._is_free, self.cells.columns
        if not (free[here] and free[there]):
            return None
        (row, column), (next_row, next_column) = divmod(here, columns), divmod(there, columns)
        if row != next_row and column != next_column \
                and not (free[row * columns + next_column] and free[next_row * columns + column]):
            return None
        return length_m

    def route(self, start: int, goal: int) -> Route | None:
        """Return a shortest route between two cells; None if one is not free or there is no route."""
        return self.best_route(start, {goal: 0.0}, 1.0)

    def best_route(self, start: int, gains: Mapping[int, float], cost_per_m: float) -> Route | None:
        """Return the route from `start` with the greatest gain(goal) - cost_per_m * length, over the goals of `gains`.

        None if no goal that is free can be reached, or `start` is not free. `cost_per_m` is positive: ValueError."""
        if not 0 < cost_per_m < float("inf"):
            raise ValueError(f"cost_per_m={cost_per_m}: expected more than 0; without a cost any detour is as good")
        goals = {goal: gain for goal, gain in gains.items() if self.free[goal]}
        if not goals or not self.free[start]:
            return None
        best = max(goals.values())
        missing_m = {goal: (best - gain) / cost_per_m for goal, gain in goals.items()}      # as a length
        ahead_m = self._least_m(missing_m)
        self._graph.add_weighted_edges_from((goal, BEHIND, length) for goal, length in missing_m.items())
        try:
            found = nx.astar_path(self._graph, start, BEHIND, heuristic=lambda cell, _: ahead_m[cell],
                                  weight=self._length_m)
        except nx.NetworkXNoPath:
            return None
        finally:
            self._graph.remove_node(BEHIND)
        way = found[:-1]
        return Route(way, fsum(self._graph.edges[edge]["weight"] for edge in pairwise(way)))

    def _least_m(self, missing_m: Mapping[int, float]) -> list[float]:
        """Lower bounds of the length from each cell to the node behind the goals; the last element is that node's."""
        goals = np.fromiter(missing_m, dtype=np.intp)
        row, column = np.divmod(np.arange(self.free.size), self.cells.columns)
        dx = np.abs(column[:, None] - column[goals])
        dy = np.abs(row[:, None] - row[goals])
        octile = self.cells.side_m * (np.maximum(dx, dy) + (sqrt(2.0) - 1.0) * np.minimum(dx, dy))
        least = np.min(octile + np.fromiter(missing_m.values(), dtype=float), axis=1)
        return [*least.tolist(), 0.0]

    def reachable(self, start: int) -> Mask:
        """Return which cells have a route from `start`, shape (rows * columns,); none if `start` is not free."""
        if not self.free[start]:
            return np.zeros(self.free.size, dtype=bool)
        # A diagonal edge needs both cells beside it, so who is connected follows from the straight edges alone.
        parts, _ = label(self.free.reshape(self.cells.rows, self.cells.columns))
        return np.asarray(parts.ravel() == parts.flat[start])

    def nearest(self, place: Place, among: Mask | None = None) -> int | None:
        """Return the free cell (of `among`, if given) whose centroid is nearest to a place; None if there is none.

        Of cells at equal distances the one with the lowest number is taken."""
        candidates = np.flatnonzero(self.free if among is None else self.free & among)
        if not len(candidates):
            return None
        away = self.cells.centroids_m[candidates] - np.asarray(place)
        return int(candidates[np.argmin(np.sum(away ** 2, axis=1))])


@lru_cache(maxsize=4)
def _all_cells(cells: Cells) -> Any:
    """Return the graph of all cells, free or not. All sensors share it: a caller that adds a node removes it again."""
    graph: Any = nx.Graph()
    number = np.arange(cells.rows * cells.columns).reshape(cells.rows, cells.columns)
    graph.add_nodes_from(number.ravel().tolist())
    straight, diagonal = cells.side_m, cells.side_m * sqrt(2.0)
    for here, there, length_m in ((number[:, :-1], number[:, 1:], straight), (number[:-1], number[1:], straight),
                                  (number[:-1, :-1], number[1:, 1:], diagonal),
                                  (number[:-1, 1:], number[1:, :-1], diagonal)):
        graph.add_edges_from(zip(here.ravel().tolist(), there.ravel().tolist(), strict=True), weight=length_m)
    return graph
