"""The field of view of a camera: a disk or sector on the ground, less the shadows of round obstacles.

    in view     |p - c| <= range  and  |angle of (p - c) from the heading| <= half angle
    occluded    the line from the camera c to the body p passes an obstacle's centre closer than its radius

Distances are horizontal: a camera above the ground looks down.
Not modelled: bodies that hide others; distortion; the size of bodies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, hypot, inf, isfinite, pi, radians, remainder

from netem.core.fate import Fate
from netem.media.sensing.sight import Body


@dataclass(frozen=True)
class Obstacle:
    at_m: tuple[float, float]
    radius_m: float

    def __post_init__(self) -> None:
        if not all(map(isfinite, self.at_m)):
            raise ValueError(f"at_m={list(self.at_m)}: expected finite numbers")
        if not (isfinite(self.radius_m) and self.radius_m > 0):
            raise ValueError(f"radius_m={self.radius_m}: expected more than 0")

    def hides(self, camera: Body, body: Body) -> bool:
        to_x, to_y = body.x_m - camera.x_m, body.y_m - camera.y_m
        at_x, at_y = self.at_m[0] - camera.x_m, self.at_m[1] - camera.y_m
        length2 = to_x * to_x + to_y * to_y
        share = min(1.0, max(0.0, (at_x * to_x + at_y * to_y) / length2)) if length2 else 0.0
        return hypot(at_x - share * to_x, at_y - share * to_y) < self.radius_m


@dataclass(frozen=True)
class FieldOfView:
    range_m: float = inf
    half_angle_deg: float = 180.0
    obstacles: Sequence[Obstacle] = ()

    def __post_init__(self) -> None:
        if not self.range_m > 0:
            raise ValueError(f"range_m={self.range_m}: expected more than 0")
        if not 0 < self.half_angle_deg <= 180:
            raise ValueError(f"half_angle_deg={self.half_angle_deg}: expected more than 0, at most 180")

    def fate(self, camera: Body, body: Body) -> Fate | None:
        """Fate of a detection of `body` that `camera` cannot make; None if it can."""
        to_x, to_y = body.x_m - camera.x_m, body.y_m - camera.y_m
        if hypot(to_x, to_y) > self.range_m:
            return Fate.OUT_OF_VIEW
        if self.half_angle_deg < 180 and (to_x or to_y):
            aside_rad = remainder(atan2(to_y, to_x) - camera.heading_rad, 2 * pi)
            if abs(aside_rad) > radians(self.half_angle_deg):
                return Fate.OUT_OF_VIEW
        if any(obstacle.hides(camera, body) for obstacle in self.obstacles):
            return Fate.OCCLUDED
        return None
