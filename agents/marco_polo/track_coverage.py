"""Track coverage P_S^k: the probability that a straight track crosses at least k fields of view.

    P_S^k = sum over boundary cells of  weight * m{ heading : at least k intervals contain it }

The intervals are those of `sight`; sorting their ends counts how many contain each heading, so no inclusion-exclusion
over cones is needed. The measure m of headings phi, relative to the normal:

    uniform     d phi / pi              targets enter at a uniform place with a uniform heading (section 2.4)
    isotropic   cos(phi) d phi / 2      the motion-invariant measure of lines; P^1 of one field of view is the ratio
                                        of perimeters (Crofton; Ferrari et al. 2009, [84])

A move of one sensor changes P_S^k by the measure of what its interval shares with the headings that exactly k - 1 of
the other intervals contain. `coverage_with` uses this for many places at once: it is Delta P_S^k of (2.4).

Source: dissertation, section 2.2.2 and (2.4). Cost: O(n m log m) for n boundary cells and m fields of view.
"""

from __future__ import annotations

from enum import Enum
from math import pi

import numpy as np
from numpy.typing import ArrayLike

from agents.marco_polo.sight import HALF_PI, Floats, boundary, fields_of_view, seen
from agents.pursuit.law import Area

BOUNDARY_CELLS = 200            # error of P^k below 1e-4 for the layouts of section 2.4


class Headings(Enum):
    """How headings of tracks are distributed at the boundary."""

    UNIFORM = "uniform"
    ISOTROPIC = "isotropic"

    def share(self, angle_rad: Floats) -> Floats:
        """Return the probability of a heading below `angle_rad`, relative to the normal, within +-pi/2."""
        if self is Headings.UNIFORM:
            return (angle_rad + HALF_PI) / pi
        return 0.5 * (1.0 + np.sin(angle_rad))


def track_coverage(area: Area, centres_m: ArrayLike, radii_m: ArrayLike, headings: Headings = Headings.UNIFORM,
                   boundary_cells: int = BOUNDARY_CELLS) -> Floats:
    """Return P_S^1 to P_S^m of m fields of view, shape (m,); element k - 1 is P_S^k.

    Centres have shape (m, 2), radii (m,) or one for all. ValueError for a radius that is not positive."""
    centres, radii = fields_of_view(centres_m, radii_m)
    count = len(centres)
    if count == 0:
        return np.zeros(0)
    edge = boundary(area, boundary_cells)
    low, high = seen(area, edge.places_m, edge.axes_rad, centres, radii)
    ends, depth = _sorted_ends(headings.share(low), headings.share(high))
    measure = np.diff(ends, axis=1) * edge.weights[:, None]
    exactly = np.bincount(depth.ravel(), weights=measure.ravel(), minlength=count + 1)
    return np.asarray(np.cumsum(exactly[:0:-1])[::-1], dtype=float)


def coverage_with(area: Area, centres_m: ArrayLike, radii_m: ArrayLike, k: int, places_m: ArrayLike, radius_m: float,
                  headings: Headings = Headings.UNIFORM, boundary_cells: int = BOUNDARY_CELLS) -> Floats:
    """Return P_S^k of m fields of view and one more of `radius_m` at each of c places, shape (c,).

    Delta P_S^k of a move from place a to place b is the difference of their elements. Equal to `track_coverage` of all
    m + 1, element k - 1, and 0 where k > m + 1."""
    if k < 1:
        raise ValueError(f"k={k}: expected at least 1 detection")
    centres, radii = fields_of_view(centres_m, radii_m)
    places, place_radii = fields_of_view(places_m, radius_m)
    edge = boundary(area, boundary_cells)
    low, high = (headings.share(end) for end in seen(area, edge.places_m, edge.axes_rad, places, place_radii))
    rows = len(edge.weights)
    if len(centres):
        ends, depth = _sorted_ends(*(headings.share(end) for end in seen(area, edge.places_m, edge.axes_rad,
                                                                         centres, radii)))
        ends = np.concatenate([np.zeros((rows, 1)), ends, np.ones((rows, 1))], axis=1)
        depth = np.pad(depth, ((0, 0), (1, 1)))             # none before the first end and after the last
    else:
        ends, depth = np.tile([0.0, 1.0], (rows, 1)), np.zeros((rows, 1), dtype=np.intp)
    gain = np.zeros_like(low)
    for piece in range(depth.shape[1]):
        decisive = depth[:, piece] == k - 1
        if decisive.any():
            begin, end = ends[:, piece, None], ends[:, piece + 1, None]
            gain += decisive[:, None] * np.maximum(0.0, np.minimum(high, end) - np.maximum(low, begin))
    others = float(np.sum(edge.weights[:, None] * np.diff(ends, axis=1) * (depth >= k)))
    return others + edge.weights @ gain


def _sorted_ends(low: Floats, high: Floats) -> tuple[Floats, np.typing.NDArray[np.intp]]:
    """Ends of intervals in ascending order, (n, 2 m), and how many intervals contain each gap, (n, 2 m - 1)."""
    count = low.shape[1]
    ends = np.concatenate([low, high], axis=1)
    order = np.argsort(ends, axis=1)
    depth = np.cumsum(np.where(order < count, 1, -1), axis=1, dtype=np.intp)[:, :-1]
    return np.take_along_axis(ends, order, axis=1), depth
