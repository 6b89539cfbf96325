"""Refusals of a game that cannot be played. Each raises ValueError: place, value, rule, and the number that would do.

The caller passes what the scenario says and, as `place`, where it says so. A check that holds returns nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import dist, floor, hypot, isfinite

import numpy as np
import shapely
from numpy.typing import ArrayLike

from agents.marco_polo.area_coverage import greatest_area_coverage
from agents.marco_polo.cells import Cells, Polygon
from agents.marco_polo.connectivity import ConnectivityGraph
from agents.pursuit import Place
from agents.pursuit.law import Area

LEAST_ENTRANCE = 0.01           # share of the boundary without obstacles
LEAST_EDGE_M = 1e-6             # of a polygon: the direction of a shorter edge is that of rounding
CONVEX = 1e-9                   # area that rounding may make, relative to that of the polygon


def check_detections(k: int, sensors: int, place: str = "detections") -> None:
    """Refuse more detections of a target than there are sensors: those of one sensor are not independent."""
    if k > sensors:
        raise ValueError(f"{place}={k}: independent detections are of different sensors, and there are {sensors}; take "
                         f"{sensors} or less")


def check_pursuers(ugvs: int, place: str = "sensors") -> None:
    """Refuse a team without a UGV: UAVs cannot capture."""
    if ugvs < 1:
        raise ValueError(f"{place}: {ugvs} UGVs, and a UAV cannot capture; add at least 1 UGV")


def check_area_coverage(area: Area, radii_m: ArrayLike, least: float, place: str = "least_area_coverage") -> None:
    """Refuse a least area coverage that the radii cannot give, even without overlap."""
    limit = greatest_area_coverage(area, radii_m)
    if not 0 <= least <= limit:
        raise ValueError(f"{place}={least}: {np.asarray(radii_m).size} fields of view cover at most {limit:.4f} of the "
                         f"area; take {floor(limit * 1e4) / 1e4:.4f} or less, or larger radii")


def check_obstacles(obstacles: Sequence[Polygon], area: Area, place: str = "obstacles") -> None:
    """Refuse a polygon that has fewer than 3 corners or the same one twice, is not convex, or protrudes from the area.

    Use it for zones as well."""
    for number, corners in enumerate(obstacles):
        where = f"{place}[{number}]"
        if len(corners) < 3 or not all(isfinite(x) and isfinite(y) for x, y in corners):
            told = _told(corners) if corners else "no corners"
            raise ValueError(f"{where}={told}: expected 3 or more corners with finite coordinates")
        polygon = shapely.Polygon(corners)
        hull = polygon.convex_hull
        if not isinstance(hull, shapely.Polygon) or hull.area <= 0.0:
            raise ValueError(f"{where}={_told(corners)}: the corners lie on a line; move at least 1 of them off it")
        for corner, following in pairwise([*corners, corners[0]]):
            if dist(corner, following) < LEAST_EDGE_M:
                raise ValueError(f"{where}={_told(corners)}: corner {_told([following])} is given twice in a row, as "
                                 "the last one comes before the first; leave one of them out")
        if not polygon.is_valid or hull.area - polygon.area > CONVEX * hull.area:
            inside = max((hull.exterior.distance(shapely.Point(corner)), corner) for corner in corners)
            why = (f"corner {_told([inside[1]])} lies {inside[0]:.3g} m inside the convex hull" if polygon.is_valid
                   else "its sides cross")
            ring = [(float(x), float(y)) for x, y in shapely.get_coordinates(hull)[:-1]]
            raise ValueError(f"{where}={_told(corners)}: not convex, {why}; take the hull, {_told(ring)}, or divide it "
                             "into convex obstacles")
        for x, y in corners:
            if not (area.x_m[0] <= x <= area.x_m[1] and area.y_m[0] <= y <= area.y_m[1]):
                near = area.nearest((x, y))
                raise ValueError(f"{where}: corner {_told([(x, y)])} is outside the area; the nearest place inside is "
                                 f"{_told([near])}")


def check_entrances(area: Area, obstacles: Sequence[Polygon], place: str = "obstacles") -> None:
    """Refuse obstacles that leave less than `LEAST_ENTRANCE` of the area's boundary for targets to enter by."""
    boundary = shapely.box(area.x_m[0], area.y_m[0], area.x_m[1], area.y_m[1]).exterior
    covered = shapely.union_all([shapely.Polygon(corners) for corners in obstacles])
    share = shapely.difference(boundary, covered).length / boundary.length
    if share < LEAST_ENTRANCE:
        raise ValueError(f"{place}: cover {1 - share:.1%} of the area's boundary, and targets enter elsewhere; leave "
                         f"{LEAST_ENTRANCE:.0%} or more of it free, {LEAST_ENTRANCE * boundary.length:g} m")


def check_starts(cells: Cells, starts: Mapping[str, Place], obstacles: Sequence[Polygon], zones: Sequence[Polygon],
                 platform_m: float, aerial: frozenset[str] = frozenset(), place: str = "starts") -> None:
    """Refuse a start whose platform overlaps an obstacle (but for `aerial` sensors) or a zone, or protrudes.

    The remedy is the middle of the nearest cell that would do."""
    for name, start in starts.items():
        barriers = [*((("obstacle", number, corners) for number, corners in enumerate(obstacles))
                      if name not in aerial else ()),
                    *(("zone", number, corners) for number, corners in enumerate(zones))]
        half = 0.5 * platform_m
        platform = shapely.box(start[0] - half, start[1] - half, start[0] + half, start[1] + half)
        why = None
        for kind, number, corners in barriers:
            overlap = shapely.intersection(platform, shapely.Polygon(corners)).area
            if overlap > CONVEX * platform.area:
                why = f"its platform of {platform_m:g} m overlaps {kind} {number} by {overlap:.3g} m2"
                break
        if cells.area.nearest((start[0] - half, start[1] - half)) != (start[0] - half, start[1] - half) or \
                cells.area.nearest((start[0] + half, start[1] + half)) != (start[0] + half, start[1] + half):
            why = f"its platform of {platform_m:g} m protrudes from the area"
        if why is None:
            continue
        graph = ConnectivityGraph(cells, cells.free([corners for _, _, corners in barriers], platform_m))
        near = graph.nearest(start)
        remedy = ("no cell is free, make obstacles and zones smaller" if near is None
                  else f"the nearest cell that would do is at {_told([cells.centroid(near)])}, move it there")
        raise ValueError(f"{place}.{name}={_told([start])}: {why}; {remedy}")


def check_exits(cells: Cells, ugv_starts: Mapping[str, Place], obstacles: Sequence[Polygon], zones: Sequence[Polygon],
                platform_m: float, place: str = "obstacles") -> None:
    """Refuse a free cell at the boundary that no UGV can reach: a target that leaves there cannot be pursued.

    The remedy is the place nearest to that exit that a UGV can reach."""
    graph = ConnectivityGraph(cells, cells.free([*obstacles, *zones], platform_m))
    reached = np.zeros(len(graph.free), dtype=bool)
    for start in ugv_starts.values():
        reached |= graph.reachable(cells.cell_at(start))
    row, column = np.divmod(np.arange(len(graph.free)), cells.columns)
    at_boundary = (row == 0) | (row == cells.rows - 1) | (column == 0) | (column == cells.columns - 1)
    missed = np.flatnonzero(graph.free & at_boundary & ~reached)
    if not len(missed):
        return
    exit_place = cells.centroid(int(missed[0]))
    near = graph.nearest(exit_place, reached)
    if near is None:
        raise ValueError(f"{place}: no UGV of {sorted(ugv_starts)} starts in a free cell; move one to "
                         f"{_told([cells.centroid(int(np.flatnonzero(graph.free)[0]))])}")
    to = cells.centroid(near)
    away = hypot(to[0] - exit_place[0], to[1] - exit_place[1])
    raise ValueError(f"{place}: the exit at {_told([exit_place])}, and {len(missed) - 1} more, is out of reach of all "
                     f"UGVs, {sorted(ugv_starts)}; the nearest place within is {_told([to])}, {away:.3g} m away: "
                     f"open a gap of {max(platform_m, cells.side_m):g} m between them, or start a UGV beyond")


def _told(places: Sequence[Place]) -> str:
    """Places as "(1, 2.5) (3, 4) m"."""
    return " ".join(f"({x:g}, {y:g})" for x, y in places) + " m"
