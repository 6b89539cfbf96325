"""Where one platform can drive: obstacles that stand, and the platforms of others, which move.

On the grid a platform keeps to free cells. Off it, as after a straight leg towards a target, it needs a leg that is
clear: the square that moves along it, without turning, overlaps no obstacle; to touch one is allowed.

Not modelled: whether a straight leg meets the platform of another sensor; the grid leaves those out.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import shapely

from agents.marco_polo.cells import TOUCHING, Cells, Polygon, square
from agents.marco_polo.connectivity import ConnectivityGraph
from agents.pursuit import Place

ENTRIES = 16                    # cells that are tried, from the nearest on, to come onto the grid


class Ground:
    """`barriers` are convex polygons: obstacles, and zones that are virtual obstacles."""

    def __init__(self, cells: Cells, barriers: Sequence[Polygon], platform_m: float) -> None:
        self.cells = cells
        self._platform_m = platform_m
        self._barriers = [shapely.Polygon(corners) for corners in barriers]
        self._free = cells.free(barriers, platform_m)

    def graph(self, others: Iterable[Place] = ()) -> ConnectivityGraph:
        """Return the cells that the platform can occupy while the platforms of `others` are where they are."""
        platforms = [square(place, self._platform_m) for place in others]
        return ConnectivityGraph(self.cells, self._free & self.cells.free(platforms, self._platform_m))

    def clear(self, start: Place, end: Place, slack_m: float = 0.0) -> bool:
        """Return whether the platform can drive straight from `start` to `end`, which may be the same place.

        It may overlap barriers by `slack_m`."""
        if not self._barriers:
            return True
        half = 0.5 * self._platform_m * (1.0 - TOUCHING) - slack_m
        if start == end:
            swept: shapely.Geometry = shapely.box(start[0] - half, start[1] - half, start[0] + half, start[1] + half)
        else:
            swept = shapely.MultiPoint([(x + dx, y + dy) for x, y in (start, end) for dx in (-half, half)
                                        for dy in (-half, half)]).convex_hull
        return not any(shapely.intersects(barrier, swept) for barrier in self._barriers)

    def entry(self, graph: ConnectivityGraph, place: Place) -> int | None:
        """Return the nearest free cell with a clear leg to it; None if there is none among the `ENTRIES` nearest."""
        candidates = np.flatnonzero(graph.free)
        away = np.sum((self.cells.centroids_m[candidates] - np.asarray(place)) ** 2, axis=1)
        for cell in candidates[np.argsort(away, kind="stable")[:ENTRIES]]:
            if self.clear(place, self.cells.centroid(int(cell))):
                return int(cell)
        return None

    def way(self, graph: ConnectivityGraph, place: Place, goal: Place) -> list[Place]:
        """Return the waypoints [m] from a place, by cells, to the cell nearest to `goal` that can be reached.

        Empty if the platform cannot come onto the grid."""
        start = self.entry(graph, place)
        end = None if start is None else graph.nearest(goal, graph.reachable(start))
        route = None if start is None or end is None else graph.route(start, end)
        if route is None:
            return []
        way = [self.cells.centroid(cell) for cell in route.cells]
        return way[1:] if len(way) > 1 and self.clear(place, way[1]) else way
