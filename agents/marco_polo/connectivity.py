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
from itertools import pairwise
from math import sqrt
from typing import Any, NamedTuple

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from agents.marco_polo.cells import Cells, Mask
from agents.pursuit import Place

BEHIND = -1                     # the node behind all goals


class Route(NamedTuple):
    cells: list[int]            # from the start to the goal, both included
    length_m: float


class ConnectivityGraph:
    """The free cells of one sensor and their neighbours. Make a new one when obstacles move."""

    def __init__(self, cells: Cells, free: Mask) -> None:
        """`free` has shape (rows * columns,); ValueError for any other."""
        if free.shape != (cells.rows * cells.columns,):
            raise ValueError(f"free cells of shape {free.shape}: expected {(cells.rows * cells.columns,)}")
        self.cells = cells
        self.free = free
        self._graph: Any = nx.Graph()
        self._graph.add_nodes_from(np.flatnonzero(free).tolist())
        grid, number = free.reshape(cells.rows, cells.columns), np.arange(free.size).reshape(cells.rows, cells.columns)
        straight, diagonal = cells.side_m, cells.side_m * sqrt(2.0)
        west, east, south, north = np.s_[:, :-1], np.s_[:, 1:], np.s_[:-1, :], np.s_[1:, :]
        self._join(number[west], number[east], grid[west] & grid[east], straight)
        self._join(number[south], number[north], grid[south] & grid[north], straight)
        block = grid[:-1, :-1] & grid[:-1, 1:] & grid[1:, :-1] & grid[1:, 1:]
        self._join(number[:-1, :-1], number[1:, 1:], block, diagonal)
        self._join(number[:-1, 1:], number[1:, :-1], block, diagonal)

    def _join(self, here: NDArray[np.intp], there: NDArray[np.intp], where: Mask, length_m: float) -> None:
        self._graph.add_edges_from(zip(here[where].tolist(), there[where].tolist(), strict=True), weight=length_m)

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
            found = nx.astar_path(self._graph, start, BEHIND, heuristic=lambda cell, _: ahead_m[cell])
        except nx.NetworkXNoPath:
            return None
        finally:
            self._graph.remove_node(BEHIND)
        way = found[:-1]
        return Route(way, sum(self._graph.edges[edge]["weight"] for edge in pairwise(way)))

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
        found = np.zeros(self.free.size, dtype=bool)
        if self.free[start]:
            found[list(nx.node_connected_component(self._graph, start))] = True
        return found

    def nearest(self, place: Place, among: Mask | None = None) -> int | None:
        """Return the free cell (of `among`, if given) whose centroid is nearest to a place; None if there is none.

        Of cells at equal distances the one with the lowest number is taken."""
        candidates = np.flatnonzero(self.free if among is None else self.free & among)
        if not len(candidates):
            return None
        away = self.cells.centroids_m[candidates] - np.asarray(place)
        return int(candidates[np.argmin(np.sum(away ** 2, axis=1))])

