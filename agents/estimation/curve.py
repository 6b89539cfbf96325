"""A directed circle or line as point, tangent and signed curvature; a line has curvature 0, no centre and no radius.

    p(s) = p0 + s sinc(k s / 2) (cos(k s / 2) t + sin(k s / 2) n)       sinc(x) = sin(x) / x, n = t turned left

s is the signed length along the curve from p0. For a point (a, b) = p - p0 in the frame (t, n):

    s = atan2(k a, 1 - k b) / k                               length to its foot, within half a turn of p0; a line: a
    d = q / (1 + sqrt(1 - k q)), q = 2 b - k (a^2 + b^2)      distance from the curve, positive to the left

Both stay exact when k goes to 0 (Chernov and Lesort 2005 call this the natural parametrization).
"""

from __future__ import annotations

from math import atan2, cos, inf, pi, sin, sqrt
from typing import NamedTuple

STRAIGHT_RAD = 1e-8             # for angles below, sinc(x) = 1 and sin(x) = x to 1e-16


class Curve(NamedTuple):
    x_m: float                  # p0, on the curve
    y_m: float
    tx: float                   # t, unit vector along it
    ty: float
    k_per_m: float              # positive: to the left

    def at(self, s_m: float) -> tuple[float, float]:
        """Return the point (x, y) [m] at signed length s."""
        half = 0.5 * self.k_per_m * s_m
        if half < STRAIGHT_RAD and half > -STRAIGHT_RAD:
            along, aside = s_m, s_m * half
        else:
            sine = sin(half)
            along = s_m * sine / half
            aside = along * sine
            along *= cos(half)
        return self.x_m + along * self.tx - aside * self.ty, self.y_m + along * self.ty + aside * self.tx

    def heading_rad(self, s_m: float) -> float:
        """Return the direction of the tangent at s, not wrapped."""
        return atan2(self.ty, self.tx) + self.k_per_m * s_m

    def foot_m(self, x_m: float, y_m: float) -> float:
        """Return the signed length s of the curve's point nearest to (x, y), within half a turn of p0."""
        dx, dy, k = x_m - self.x_m, y_m - self.y_m, self.k_per_m
        a, b = dx * self.tx + dy * self.ty, dy * self.tx - dx * self.ty
        turn = atan2(k * a, 1.0 - k * b)
        return turn / k if abs(turn) > STRAIGHT_RAD else a / (1.0 - k * b)

    def distance_m(self, x_m: float, y_m: float) -> float:
        """Return the signed distance of (x, y) from the curve, positive to the left."""
        dx, dy, k = x_m - self.x_m, y_m - self.y_m, self.k_per_m
        q = 2.0 * (dy * self.tx - dx * self.ty) - k * (dx * dx + dy * dy)
        return q / (1.0 + sqrt(max(1.0 - k * q, 0.0)))

    @property
    def turn_m(self) -> float:
        """Length of a whole turn, infinite for a line."""
        return 2.0 * pi / abs(self.k_per_m) if self.k_per_m else inf

    def moved_to(self, s_m: float) -> Curve:
        """Return the same curve with p0 at s."""
        turn = self.k_per_m * s_m
        c, s = cos(turn), sin(turn)
        return Curve(*self.at(s_m), c * self.tx - s * self.ty, c * self.ty + s * self.tx, self.k_per_m)

    def reversed(self) -> Curve:
        """Return the same curve in the opposite direction."""
        return Curve(self.x_m, self.y_m, -self.tx, -self.ty, -self.k_per_m)
