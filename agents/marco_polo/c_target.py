"""C-target: the truncated cone in which the next detection of a partially observed target is expected (Proposition 1).

In the frame whose origin is the newest detection on the track line, y along the line and x to its right:

    { (x, y) : y >= 0,  |x| <= r c + y / alpha }            alpha = tan(pi (1 - c) / 2)

c is the *cone content*: the probability that a heading, uniform within +-pi/2 of the bisector, lies within +-pi c / 2.
r is the sensor's radius. The cone grows with c. The content holds for the heading of one leg, not for positions: with
r = 1.25 m and legs of 1 m, the share of targets inside after 1, 3, 10 legs is 0.517, 0.692, 0.878 for c = 0.3.

Differs from the dissertation:
- Definition 7 and Proposition 1 use one epsilon, but Definition 7's region shrinks as epsilon grows and Proposition 1's
  grows. The cone has `content`; the probability above which a cell is an observation cell is `threshold`
  (`detection_probability`).
- The slopes are +-alpha, not alpha and pi - alpha.

Source: dissertation, Definition 7, Proposition 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, isfinite, pi, sin, tan

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from agents.marco_polo.track_line import TrackLine
from agents.pursuit import Place
from agents.pursuit.law import Area


@dataclass(frozen=True)
class CTarget:
    track: TrackLine
    radius_m: float             # r, of the sensor's field of view
    content: float              # c, 0 < c < 1

    def __post_init__(self) -> None:
        if not (isfinite(self.radius_m) and self.radius_m > 0):
            raise ValueError(f"radius_m={self.radius_m}: expected more than 0")
        if not 0 < self.content < 1:
            raise ValueError(f"cone_content={self.content}: expected 0 < cone_content < 1, as 0.5")

    @property
    def slope(self) -> float:
        """alpha: how far the boundary rises along the bisector for 1 m across."""
        return tan(0.5 * pi * (1.0 - self.content))

    def half_width_m(self, along_m: float) -> float:
        """Return the distance from the bisector to the boundary at `along_m` [m] from the newest detection."""
        return self.radius_m * self.content + along_m / self.slope

    def along_and_across_m(self, places_m: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return y (along the bisector) and x (to its right) of places of shape (..., 2), each (...,)."""
        away = np.asarray(places_m, dtype=float) - np.asarray(self.track.last)
        ux, uy = cos(self.track.heading_rad), sin(self.track.heading_rad)
        return away[..., 0] * ux + away[..., 1] * uy, away[..., 0] * uy - away[..., 1] * ux

    def place(self, along_m: float, across_m: float) -> Place:
        """Return the place [m] at y = `along_m`, x = `across_m` of the C-target's frame."""
        ux, uy = cos(self.track.heading_rad), sin(self.track.heading_rad)
        return (self.track.last[0] + along_m * ux + across_m * uy, self.track.last[1] + along_m * uy - across_m * ux)

    def contains(self, places_m: ArrayLike) -> NDArray[np.bool_]:
        """Return which of the places, shape (..., 2), lie in the C-target; the boundary counts."""
        along, across = self.along_and_across_m(places_m)
        return np.asarray((along >= 0.0) & (np.abs(across) <= self.radius_m * self.content + along / self.slope))

    def outline(self, area: Area) -> list[Place]:
        """Return the corners [m], counterclockwise, of the C-target's part inside the area; [] if there is none."""
        polygon = self._clipped(area)
        if not isinstance(polygon, shapely.Polygon) or polygon.is_empty:
            return []
        ring = shapely.get_coordinates(shapely.orient_polygons(polygon).exterior)[:-1]
        return [(float(x), float(y)) for x, y in ring]

    def area_m2(self, area: Area) -> float:
        """Return the size [m2] of the part inside the area."""
        return float(self._clipped(area).area)

    def depth_m(self, area: Area) -> float:
        """Return how far [m] along the bisector the part inside the area reaches; 0 if there is none."""
        corners = self.outline(area)
        return float(np.max(self.along_and_across_m(corners)[0])) if corners else 0.0

    def _clipped(self, area: Area) -> shapely.Geometry:
        (west, east), (south, north) = area.x_m, area.y_m
        far = hypot(east - west, north - south) + hypot(self.track.last[0] - west, self.track.last[1] - south)
        near, wide = self.half_width_m(0.0), self.half_width_m(far)
        cone = shapely.Polygon([self.place(0.0, -near), self.place(0.0, near), self.place(far, wide),
                                self.place(far, -wide)])
        return shapely.intersection(cone, shapely.box(west, south, east, north))

