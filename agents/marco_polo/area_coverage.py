"""Area coverage: the share of the area that lies in at least one field of view (the constraint of section 2.1).

The area is cut by horizontal scan lines at the middles of equal strips. Each field of view covers an interval of a scan
line, the length of their union is exact, and the sum over scan lines is the midpoint rule. Its error for n scan lines
is below 1e-3 of the area for n = 200 and fields of view as in section 2.4.
"""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.marco_polo.sight import Floats, fields_of_view
from agents.pursuit.law import Area

SCAN_LINES = 400


def area_coverage(area: Area, centres_m: ArrayLike, radii_m: ArrayLike, scan_lines: int = SCAN_LINES) -> float:
    """Return the share of the area, 0 to 1, that m fields of view cover; centres (m, 2), radii (m,) or one for all."""
    centres, radii = fields_of_view(centres_m, radii_m)
    if scan_lines < 1:
        raise ValueError(f"scan_lines={scan_lines}: expected at least 1")
    if len(centres) == 0:
        return 0.0
    begin, end = _intervals(area, centres, radii, scan_lines)
    west, east = area.x_m
    order = np.argsort(begin, axis=1)
    begin, end = np.take_along_axis(begin, order, axis=1), np.take_along_axis(end, order, axis=1)
    reached = np.maximum.accumulate(end, axis=1)
    before = np.concatenate([np.full((scan_lines, 1), west), reached[:, :-1]], axis=1)
    return float(np.sum(np.maximum(0.0, reached - np.maximum(begin, before))) / scan_lines / (east - west))


def area_coverage_gradient(area: Area, centres_m: ArrayLike, radii_m: ArrayLike,
                           scan_lines: int = SCAN_LINES) -> Floats:
    """Return the gradient [1/m] of the area coverage by the centres, shape (m, 2).

    A field of view that moves to the right covers more where its right end on a scan line is exposed, that is inside
    the area and in no other field of view, and less where its left end is."""
    centres, radii = fields_of_view(centres_m, radii_m)
    gradient = np.empty((len(centres), 2))
    turned = Area(area.y_m, area.x_m)
    for axis, (plane, places) in enumerate(((area, centres), (turned, centres[:, ::-1]))):
        begin, end = _intervals(plane, places, radii, scan_lines)
        rises = np.sum(_exposed(end, begin, end, plane.x_m), axis=0)
        falls = np.sum(_exposed(begin, begin, end, plane.x_m), axis=0)
        gradient[:, axis] = (rises - falls) / scan_lines / (plane.x_m[1] - plane.x_m[0])
    return gradient


def _intervals(area: Area, centres: Floats, radii: Floats, scan_lines: int) -> tuple[Floats, Floats]:
    """Ends of what each field of view covers of each scan line, (scan_lines, m), clipped to the area."""
    south, north = area.y_m
    y = south + (np.arange(scan_lines) + 0.5) * (north - south) / scan_lines
    half = np.sqrt(np.maximum(radii ** 2 - (y[:, None] - centres[:, 1]) ** 2, 0.0))
    return np.clip(centres[:, 0] - half, *area.x_m), np.clip(centres[:, 0] + half, *area.x_m)


def _exposed(ends: Floats, begin: Floats, end: Floats, walls: tuple[float, float]) -> NDArray[np.bool_]:
    """Which ends of intervals that are not empty lie between the walls and inside no other interval."""
    hidden = (begin[:, None, :] < ends[:, :, None]) & (ends[:, :, None] < end[:, None, :])
    return np.asarray((begin < end) & (walls[0] < ends) & (ends < walls[1]) & ~hidden.any(axis=2))


def greatest_area_coverage(area: Area, radii_m: ArrayLike) -> float:
    """Return an upper bound of the area coverage for given radii: fields of view inside the area without overlap."""
    whole = (area.x_m[1] - area.x_m[0]) * (area.y_m[1] - area.y_m[0])
    return min(1.0, float(pi * np.sum(np.square(np.asarray(radii_m, dtype=float)))) / whole)
