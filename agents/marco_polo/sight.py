"""The headings under which a point sees each field of view: intervals of angles relative to an axis.

A track from point p with heading phi meets the convex set B if and only if phi lies in an interval [low, high]. For a
disc of radius r at distance d > r in direction psi the interval is psi -+ asin(r / d). Where the disc protrudes from
the area, B is the disc's part inside the area, and the ends of the interval are tangents that touch inside, or
directions to corners of that part. Only headings within +-pi/2 of the axis count: those that lead from the boundary
into the area, or those that a target can have (section 2.1: the scalar product of the first and the present velocity
is positive).

Not modelled: areas that are no rectangles, obstacles that hide a target.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.pursuit.law import Area

Floats = NDArray[np.float64]

HALF_PI = 0.5 * pi
TOLERANCE = 1e-12               # relative to the area's sides: a point that far outside counts as on the boundary


@dataclass(frozen=True)
class Boundary:
    """The middles of n cells into which the boundary of an area is divided; cells of one wall have equal length."""

    places_m: Floats            # (n, 2)
    axes_rad: Floats            # (n,), direction of the normal that points into the area
    weights: Floats             # (n,), length of the cell relative to the perimeter; their sum is 1


@lru_cache(maxsize=16)
def boundary(area: Area, cells: int) -> Boundary:
    """Return the area's boundary in `cells` cells, give or take what makes them whole on each wall."""
    if cells < 4:
        raise ValueError(f"boundary_cells={cells}: expected one on each wall, at least 4")
    (west, east), (south, north) = area.x_m, area.y_m
    width, height = east - west, north - south
    places, axes, weights = [], [], []
    for x, y, heading, length in ((west, south, 0.0, width), (east, south, HALF_PI, height),
                                  (east, north, pi, width), (west, north, -HALF_PI, height)):
        count = max(1, round(cells * length / (2.0 * (width + height))))
        along = (np.arange(count) + 0.5) * length / count
        places.append(np.stack([x + along * np.cos(heading), y + along * np.sin(heading)], axis=1))
        axes.append(np.full(count, heading + HALF_PI))
        weights.append(np.full(count, length / count / (2.0 * (width + height))))
    return Boundary(np.concatenate(places), np.concatenate(axes), np.concatenate(weights))


def fields_of_view(centres_m: ArrayLike, radii_m: ArrayLike) -> tuple[Floats, Floats]:
    """Return centres of shape (m, 2) and radii of shape (m,); one radius counts for all centres.

    ValueError if a centre is not finite or a radius is not positive."""
    centres = np.asarray(centres_m, dtype=float).reshape(-1, 2)
    radii = np.broadcast_to(np.asarray(radii_m, dtype=float), (len(centres),))
    if not np.isfinite(centres).all():
        raise ValueError(f"centres_m={centres.tolist()}: expected finite coordinates")
    if not (np.isfinite(radii).all() and (radii > 0).all()):
        raise ValueError(f"radii_m={radii.tolist()}: expected more than 0")
    return centres, radii


def seen(area: Area, origins_m: Floats, axes_rad: Floats, centres_m: Floats, radii_m: Floats) -> tuple[Floats, Floats]:
    """Return the lower and the upper ends [rad] of the intervals in which n origins see m fields of view, each (n, m).

    Angles are relative to the axis of their origin, -pi/2 <= low <= high <= pi/2; low = high if the origin sees nothing
    of that field of view. An origin inside a field of view sees it under all headings. Origins, of shape (n, 2), lie in
    the area; axes have shape (n,), centres (m, 2), radii (m,)."""
    cosine, sine = np.cos(axes_rad)[:, None], np.sin(axes_rad)[:, None]
    dx = centres_m[:, 0] - origins_m[:, 0, None]
    dy = centres_m[:, 1] - origins_m[:, 1, None]
    distance2 = dx * dx + dy * dy
    middle = np.arctan2(cosine * dy - sine * dx, cosine * dx + sine * dy)
    inside = distance2 <= radii_m * radii_m
    half = np.arcsin(radii_m / np.sqrt(np.where(inside, radii_m * radii_m, distance2)))
    low, high = middle - half, middle + half

    lower, upper = np.array([area.x_m[0], area.y_m[0]]), np.array([area.x_m[1], area.y_m[1]])
    protrudes = ((centres_m - radii_m[:, None] < lower) | (centres_m + radii_m[:, None] > upper)).any(axis=1)
    if protrudes.any():
        low[:, protrudes], high[:, protrudes] = _seen_of_clipped(
            lower, upper, origins_m, axes_rad, centres_m[protrudes], radii_m[protrudes])
        low, high = np.where(high > 3.0 * HALF_PI, low - 2.0 * pi, low), \
            np.where(high > 3.0 * HALF_PI, high - 2.0 * pi, high)
        low, high = np.where(low < -3.0 * HALF_PI, low + 2.0 * pi, low), \
            np.where(low < -3.0 * HALF_PI, high + 2.0 * pi, high)
    low[inside], high[inside] = -HALF_PI, HALF_PI
    return np.clip(low, -HALF_PI, HALF_PI), np.clip(high, -HALF_PI, HALF_PI)


def _seen_of_clipped(lower: Floats, upper: Floats, origins_m: Floats, axes_rad: Floats, centres_m: Floats,
                     radii_m: Floats) -> tuple[Floats, Floats]:
    """The same of fields of view that protrude from the area: the extremes over tangents and corners, not clipped."""
    slack = TOLERANCE * float(np.max(upper - lower))
    within = np.clip(centres_m, lower, upper)           # a point of each part inside the area, if there is one
    away = within[None] - origins_m[:, None]

    owner, corners = _corners(lower, upper, centres_m, radii_m, slack)
    begin = np.searchsorted(owner, np.arange(len(centres_m)))
    turns = _turn(away[:, owner], corners[None] - origins_m[:, None])
    highest = np.maximum(np.maximum.reduceat(turns, begin, axis=1), 0.0)
    lowest = np.minimum(np.minimum.reduceat(turns, begin, axis=1), 0.0)

    to_centre = centres_m[None] - origins_m[:, None]
    distance2 = np.sum(to_centre ** 2, axis=-1)
    reach = np.sqrt(np.maximum(distance2 - radii_m ** 2, 0.0))
    safe2 = np.where(distance2 > 0.0, distance2, 1.0)
    forward, aside = reach * reach / safe2, reach * radii_m / safe2     # along and across the direction to the centre
    for sign in (-1.0, 1.0):
        to_touch = np.stack([forward * to_centre[..., 0] - sign * aside * to_centre[..., 1],
                             forward * to_centre[..., 1] + sign * aside * to_centre[..., 0]], axis=-1)
        touch = origins_m[:, None] + to_touch
        touches = ((touch >= lower - slack) & (touch <= upper + slack)).all(axis=-1)
        turn = _turn(away, to_touch)
        highest = np.where(touches, np.maximum(highest, turn), highest)
        lowest = np.where(touches, np.minimum(lowest, turn), lowest)

    axes = np.stack([np.cos(axes_rad), np.sin(axes_rad)], axis=-1)[:, None]
    reference = _turn(np.broadcast_to(axes, away.shape), away)
    empty = np.sum((within - centres_m) ** 2, axis=-1) >= radii_m ** 2
    return np.where(empty, 0.0, reference + lowest), np.where(empty, 0.0, reference + highest)


def _corners(lower: Floats, upper: Floats, centres_m: Floats, radii_m: Floats,
             slack: float) -> tuple[NDArray[np.intp], Floats]:
    """Corners of the discs' parts inside the area: where circles cross walls, and corners of the area inside discs.

    Returns the index of the disc, ascending, and the place of each corner. Each disc has at least one entry: the point
    of the area nearest to its centre."""
    signs, walls = np.array([-1.0, 1.0]), np.stack([lower, upper])          # walls[:, axis]
    within = np.clip(centres_m, lower, upper)
    x, y, valid = [within[:, :1]], [within[:, 1:]], [np.ones((len(centres_m), 1), dtype=bool)]
    half2 = radii_m[:, None, None] ** 2 - (walls - centres_m[:, None]) ** 2             # (m, wall, axis)
    half = np.sqrt(np.maximum(half2, 0.0))
    for axis, along, across in ((0, x, y), (1, y, x)):
        other = centres_m[:, 1 - axis, None, None] + half[:, :, axis, None] * signs     # (m, wall, sign)
        along.append(np.repeat(np.tile(walls[:, axis], (len(centres_m), 1)), 2, axis=1))
        across.append(other.reshape(-1, 4))
        valid.append(((half2[:, :, axis, None] >= 0.0) & (other >= lower[1 - axis] - slack)
                      & (other <= upper[1 - axis] + slack)).reshape(-1, 4))
    corner_x, corner_y = walls[[0, 0, 1, 1], 0], walls[[0, 1, 0, 1], 1]
    x.append(np.tile(corner_x, (len(centres_m), 1)))
    y.append(np.tile(corner_y, (len(centres_m), 1)))
    valid.append((centres_m[:, :1] - corner_x) ** 2 + (centres_m[:, 1:] - corner_y) ** 2 <= radii_m[:, None] ** 2)
    owner, entry = np.nonzero(np.concatenate(valid, axis=1))
    return owner, np.stack([np.concatenate(x, axis=1)[owner, entry], np.concatenate(y, axis=1)[owner, entry]], axis=1)


def _turn(start: Floats, end: Floats) -> Floats:
    """Angles [rad] in [-pi, pi] from the vectors `start` to the vectors `end`, counterclockwise."""
    return np.arctan2(start[..., 0] * end[..., 1] - start[..., 1] * end[..., 0],
                      start[..., 0] * end[..., 0] + start[..., 1] * end[..., 1])
