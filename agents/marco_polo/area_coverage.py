"""Area coverage: the share of the area that lies in at least one field of view (the constraint of section 2.1).

The area is cut by horizontal scan lines at the middles of equal strips. Each field of view covers an interval of a scan
line, the length of their union is exact, and the sum over scan lines is the midpoint rule. Its error for n scan lines
is below 1e-3 of the area for n = 200 and fields of view as in section 2.4.
"""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import ArrayLike

from agents.marco_polo.sight import fields_of_view
from agents.pursuit.law import Area

SCAN_LINES = 400


def area_coverage(area: Area, centres_m: ArrayLike, radii_m: ArrayLike, scan_lines: int = SCAN_LINES) -> float:
    """Return the share of the area, 0 to 1, that m fields of view cover; centres (m, 2), radii (m,) or one for all."""
    centres, radii = fields_of_view(centres_m, radii_m)
    if scan_lines < 1:
        raise ValueError(f"scan_lines={scan_lines}: expected at least 1")
    if len(centres) == 0:
        return 0.0
    (west, east), (south, north) = area.x_m, area.y_m
    y = south + (np.arange(scan_lines) + 0.5) * (north - south) / scan_lines
    half = np.sqrt(np.maximum(radii ** 2 - (y[:, None] - centres[:, 1]) ** 2, 0.0))
    begin = np.clip(centres[:, 0] - half, west, east)
    end = np.clip(centres[:, 0] + half, west, east)
    order = np.argsort(begin, axis=1)
    begin, end = np.take_along_axis(begin, order, axis=1), np.take_along_axis(end, order, axis=1)
    reached = np.maximum.accumulate(end, axis=1)
    before = np.concatenate([np.full((scan_lines, 1), west), reached[:, :-1]], axis=1)
    return float(np.sum(np.maximum(0.0, reached - np.maximum(begin, before))) / scan_lines / (east - west))


def greatest_area_coverage(area: Area, radii_m: ArrayLike) -> float:
    """Return an upper bound of the area coverage for given radii: fields of view inside the area without overlap."""
    whole = (area.x_m[1] - area.x_m[0]) * (area.y_m[1] - area.y_m[0])
    return min(1.0, float(pi * np.sum(np.square(np.asarray(radii_m, dtype=float)))) / whole)
