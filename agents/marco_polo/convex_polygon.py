"""A convex polygon as a moving point meets it: how deep the point is inside, and how far it comes along a heading.

A line is clipped to the half planes of the edges (Cyrus and Beck 1978): the point is inside between the last edge that
it enters and the first that it leaves by.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import cos, fsum, hypot, inf, sin
from typing import Final

from agents.marco_polo.cells import Polygon
from agents.pursuit import Place

TOUCHING_M: Final = 1e-6        # a way through the polygon shorter than this does not enter it; nor is a point inside


class ConvexPolygon:
    """`corners` [m] go round in either direction; edges have a length."""

    def __init__(self, corners: Polygon) -> None:
        turned = fsum(x * v - u * y for (x, y), (u, v) in pairwise([*corners, corners[0]]))
        ring = list(corners) if turned > 0 else list(reversed(corners))
        self._edges = [(x, y, (v - y) / length, (x - u) / length)           # a point, and the outward normal
                       for (x, y), (u, v) in pairwise([*ring, ring[0]]) for length in [hypot(u - x, v - y)]]

    def depth_m(self, place: Place) -> float:
        """Return the distance from a place inside to the nearest edge; outside, minus the largest to the edges' lines.
        """
        return -max(nx * (place[0] - x) + ny * (place[1] - y) for x, y, nx, ny in self._edges)

    def protrusion_m(self, extent_m: Callable[[float, float], float]) -> float:
        """Return how far a convex shape protrudes over the line of an edge, at most; not above 0 if it is covered.

        `extent_m(ux, uy)` is the greatest ux x + uy y of the shape, for a direction of length 1."""
        return max(extent_m(nx, ny) - nx * x - ny * y for x, y, nx, ny in self._edges)

    def gap_m(self, extent_m: Callable[[float, float], float]) -> float:
        """Return how far such a shape is beyond the line of an edge, at most; not above 0 if no edge parts them."""
        return max(-extent_m(-nx, -ny) - nx * x - ny * y for x, y, nx, ny in self._edges)

    def way_m(self, place: Place, heading_rad: float) -> float:
        """Return how far a point comes from `place` until it enters the polygon; inf if it passes by.

        From an edge, a heading that leads away is free, and one inwards is not; along the edge rounding decides."""
        enters, leaves = 0.0, inf
        ux, uy = cos(heading_rad), sin(heading_rad)
        for x, y, nx, ny in self._edges:
            outside, outward = nx * (place[0] - x) + ny * (place[1] - y), nx * ux + ny * uy
            if outward > 0.0:
                leaves = min(leaves, -outside / outward)
            elif outward < 0.0:
                enters = max(enters, -outside / outward)
            elif outside > 0.0:
                return inf
        return enters if leaves - enters > TOUCHING_M else inf
