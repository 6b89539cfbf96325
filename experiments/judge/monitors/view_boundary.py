"""The distance from a target to the boundary of a camera's field of view: positive inside, negative outside.

    all around       d = R - r                                      r: from the camera, R: its range
    a sector, +-a    inside   d = min(R - r, way to the nearer side)
                     outside  d = -(way to the sector)              phi: angle aside of the camera's heading
    way to a side at the angle b = a - |phi| from it:   r sin b if b < 90 degrees, else r

A camera without a range sees to infinity. Horizontal distances, as in `netem.media.sensing.field_of_view`.
Not modelled: obstacles; a target behind one counts as in view.
"""

from __future__ import annotations

from math import inf, radians

import numpy as np
from numpy.typing import NDArray

from netem.media.sensing.field_of_view import FieldOfView

Floats = NDArray[np.float64]


def distance_m(view: FieldOfView, camera: tuple[Floats, Floats, Floats], target: tuple[Floats, Floats]) -> Floats:
    """Distances [m] for arrays over instants: `camera` is x [m], y [m], heading [rad]; `target` is x and y [m]."""
    to_x, to_y = target[0] - camera[0], target[1] - camera[1]
    r = np.hypot(to_x, to_y)
    if view.half_angle_deg >= 180:
        return view.range_m - r
    half = radians(view.half_angle_deg)
    aside = np.abs(np.remainder(np.arctan2(to_y, to_x) - camera[2] + np.pi, 2 * np.pi) - np.pi)
    inside = np.minimum(view.range_m - r, _to_side(r, half - aside))
    beyond = np.where(aside <= half, r - view.range_m, _from_outside(view.range_m, r, aside - half))
    return np.where((r <= view.range_m) & (aside <= half), inside, -np.abs(beyond))


def _to_side(r: Floats, angle: Floats) -> Floats:
    """Distance from a point to a ray from the camera; `angle` [rad] is between the ray and the point."""
    return np.where(np.abs(angle) < np.pi / 2, r * np.sin(np.abs(angle)), r)


def _from_outside(range_m: float, r: Floats, angle: Floats) -> Floats:
    """Distance from a point `angle` [rad] beyond a side of the sector to that side, which is `range_m` long."""
    if range_m == inf:
        return _to_side(r, angle)
    along = np.clip(r * np.cos(angle), 0.0, range_m)
    return np.hypot(r * np.cos(angle) - along, r * np.sin(angle))
