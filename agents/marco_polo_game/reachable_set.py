"""Where a target can be, from its newest detection and from later looks that did not find it.

    X(t_seen) = disk of radius e around y, e: by which a detection may be off                    {T_i(m) | y} of (3.4)
    X(t + dt) = (X(t) + disk of radius v_max dt) intersected with S
    a look at t from q that does not find the target:   X(t) = X(t) without the disk of radius R around q

The target has left the area S when X is empty. Shapes are polygons: a disk by which the set grows contains the true
one, and a disk that a look removes lies within it, so X always contains the target while it is in S.

Differs from the dissertation, whose reachable set knows no looks that saw nothing: it always contains y, and no
pursuit would ever end.
Not modelled: obstacles to the target; a least speed; headings that (2.3) rules out.
"""

from __future__ import annotations

from math import cos, pi
from typing import Final, NamedTuple

import shapely
from shapely import ops
from shapely.geometry.base import BaseGeometry

from agents.pursuit import Place
from agents.pursuit.law import Area

QUADRANT: Final = 8                             # edges of a disk's polygon in a quarter of the circle
OUTER: Final = 1.0 / cos(pi / (4 * QUADRANT))   # radius of a polygon that contains the disk of radius 1
LEAST_M: Final = 1e-6                           # a disk that is much smaller has an empty polygon


class EmptyView(NamedTuple):
    """An exposure at which the target was not within `radius_m` of `centre`."""

    at_ns: int
    centre: Place
    radius_m: float


class ReachableSet:
    def __init__(self, area: Area, v_max_mps: float, off_m: float = 0.0) -> None:
        """`off_m`: e, 0 without noise."""
        (west, east), (south, north) = area.x_m, area.y_m
        self._area = area
        self._box = shapely.box(west, south, east, north)
        self._v_max_mps, self._off_m = v_max_mps, off_m
        self._region: BaseGeometry = self._box          # X at `_at_ns`
        self._at_ns = self._seen_ns = -1
        self._empty: list[EmptyView] = []               # since the newest detection, in order of time

    def seen(self, at_ns: int, place: Place) -> None:
        """Take a detection; one that is older than the newest changes nothing."""
        if at_ns < self._seen_ns:
            return
        self._seen_ns = self._at_ns = at_ns
        self._region = shapely.Point(*self._area.nearest(place))
        if self._off_m > 0:
            self._region = self._grown(self._off_m)
        self._empty = [view for view in self._empty if view.at_ns > at_ns]
        for view in self._empty:
            self._remove(view)

    def not_seen(self, view: EmptyView) -> None:
        """Take an exposure that did not show the target; one from before the newest detection changes nothing."""
        if view.at_ns > self._at_ns:
            self._empty.append(view)
            self._remove(view)

    def left(self, now_ns: int) -> bool:
        """Return whether the target cannot be in the area any more."""
        return bool(self._empty) and self.region(now_ns).is_empty

    def region(self, now_ns: int) -> BaseGeometry:
        """Return X at `now_ns`, not before the newest detection and look; without any, the area."""
        way_m = self._v_max_mps * (now_ns - self._at_ns) * 1e-9
        if self._seen_ns < 0 or not way_m > 0 or self._region.is_empty:
            return self._region
        return self._grown(way_m)

    def nearest(self, place: Place, now_ns: int) -> Place:
        """Return the place of X that is nearest to `place`.

        `place` itself if X is empty or contains it, or if there has been no look since the newest detection."""
        if not self._empty:
            return place
        region = self.region(now_ns)
        if region.is_empty or region.covers(shapely.Point(place)):
            return place
        found, _ = ops.nearest_points(region, shapely.Point(place))
        return float(found.x), float(found.y)

    def _grown(self, by_m: float) -> BaseGeometry:
        return self._region.buffer(OUTER * max(by_m, LEAST_M), quad_segs=QUADRANT).intersection(self._box)

    def _remove(self, view: EmptyView) -> None:
        seen = shapely.Point(view.centre).buffer(view.radius_m, quad_segs=QUADRANT)
        self._region, self._at_ns = self.region(view.at_ns).difference(seen), view.at_ns
