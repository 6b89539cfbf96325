"""The pursuer's law (3.6): move straight towards the newest detection, at a limited speed.

    u = K (y - q),  |u| <= u_max            y: the detection, or the nearest point to it in the area of interest

Between detections y is constant. |y - q| falls linearly down to u_max / K, below exponentially. The area is convex and
without obstacles, so the way to y lies in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, hypot, isfinite

from agents.pursuit import Place


@dataclass(frozen=True)
class Area:
    """The area of interest, a rectangle."""

    x_m: tuple[float, float]    # from, to
    y_m: tuple[float, float]

    def __post_init__(self) -> None:
        for name in ("x_m", "y_m"):
            low, high = getattr(self, name)
            if not (isfinite(low) and isfinite(high) and low < high):
                raise ValueError(f"{name}={(low, high)}: expected from, to with from < to")

    def nearest(self, place: Place) -> Place:
        return min(max(place[0], self.x_m[0]), self.x_m[1]), min(max(place[1], self.y_m[0]), self.y_m[1])


@dataclass(frozen=True)
class PursuitLaw:
    gain_per_s: float = 1.0             # K
    u_max_mps: float = 2.0
    area: Area | None = None

    def __post_init__(self) -> None:
        for name in ("gain_per_s", "u_max_mps"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name}={getattr(self, name)}: expected more than 0")

    def velocity_mps(self, own: Place, seen: Place) -> Place:
        x, y = self.area.nearest(seen) if self.area else seen
        dx, dy = x - own[0], y - own[1]
        gain = min(self.gain_per_s, self.u_max_mps / max(hypot(dx, dy), 1e-9))
        return gain * dx, gain * dy

    def moved(self, own: Place, seen: Place, dt_s: float) -> Place:
        """Return the pursuer's place after dt_s of moving towards `seen`, exactly."""
        x, y = self.area.nearest(seen) if self.area else seen
        dx, dy = x - own[0], y - own[1]
        way = hypot(dx, dy)
        if way == 0.0:
            return own
        corner = self.u_max_mps / self.gain_per_s       # distance below which the speed is not limited
        full_s = max(0.0, (way - corner) / self.u_max_mps)
        if dt_s <= full_s:
            left = way - self.u_max_mps * dt_s
        else:
            left = min(way, corner) * exp(-self.gain_per_s * (dt_s - full_s))
        return x - dx * left / way, y - dy * left / way
