"""The track of a target: the total least-squares line through its detections, directed forward in time.

    (c, u)  minimize  sum |(p_i - c) - ((p_i - c) . u) u|^2        c: mean of the detections, u: principal axis
    angle of u = atan2(2 Sxy, Sxx - Syy) / 2                       S: scatter matrix about c

The sum of squared *distances* is minimized, as section 2.2.2 asks; ordinary least squares of y on x minimizes vertical
differences, depends on the choice of axes, and has no vertical line. The target leaves the area where the line, from
the newest detection on, crosses the boundary.

Source: dissertation, Proposition 1 and the capturing policy of section 2.2.2; Golub and Van Loan 1980.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, cos, fsum, inf, pi, sin

from agents.pursuit import Place
from agents.pursuit.law import Area


@dataclass(frozen=True)
class TrackLine:
    centroid: Place             # mean of the detections [m]
    heading_rad: float          # direction of travel, -pi to pi
    last: Place                 # foot of the newest detection on the line [m]

    def exit_point(self, area: Area) -> Place:
        """Return the point of the area's boundary that a target at `last` reaches along the line.

        ValueError if `last` is not in the area."""
        for name, value, (low, high) in (("x", self.last[0], area.x_m), ("y", self.last[1], area.y_m)):
            if not low <= value <= high:
                raise ValueError(f"newest detection on the track line, {self.last} m: {name} is outside the area, "
                                 f"{low} to {high} m; the target has left it")
        ux, uy = cos(self.heading_rad), sin(self.heading_rad)
        to_x, to_y = _way(self.last[0], ux, area.x_m), _way(self.last[1], uy, area.y_m)
        x = (area.x_m[1] if ux > 0 else area.x_m[0]) if to_x <= to_y else self.last[0] + to_y * ux
        y = (area.y_m[1] if uy > 0 else area.y_m[0]) if to_y <= to_x else self.last[1] + to_x * uy
        return min(max(x, area.x_m[0]), area.x_m[1]), min(max(y, area.y_m[0]), area.y_m[1])


def fit_track(detections: Sequence[Place], area: Area | None = None) -> TrackLine:
    """Return the track line of detections in the order of their time stamps.

    One detection has no line: with `area` the heading is then the normal of the nearest wall, about which the heading
    of a target that has just entered is uniform.

    ValueError for no detection, one without `area`, detections that are not finite, or that all coincide."""
    count = len(detections)
    if count == 0 or (count == 1 and area is None):
        raise ValueError(f"{count} detections: a track line needs 2 or more, or 1 and the area")
    for place in detections:
        if not (abs(place[0]) < inf and abs(place[1]) < inf):
            raise ValueError(f"detection {place} m: expected finite coordinates; leave it out")
    if count == 1:
        assert area is not None
        return TrackLine(detections[0], _inward(detections[0], area), detections[0])
    x = fsum(place[0] for place in detections) / count
    y = fsum(place[1] for place in detections) / count
    sxx = fsum((place[0] - x) ** 2 for place in detections)
    syy = fsum((place[1] - y) ** 2 for place in detections)
    sxy = fsum((place[0] - x) * (place[1] - y) for place in detections)
    if not sxx + syy > 0.0:
        raise ValueError(f"{count} detections, all at {detections[0]} m: a track line needs 2 different places; "
                         "leave out repeated detections")
    heading = 0.5 * atan2(2.0 * sxy, sxx - syy)
    ux, uy = cos(heading), sin(heading)
    lengths = [(place[0] - x) * ux + (place[1] - y) * uy for place in detections]
    advance = fsum((number - 0.5 * (count - 1)) * length for number, length in enumerate(lengths))
    if advance < 0.0:               # the slope of length over order of time
        heading += pi if heading <= 0.0 else -pi
        ux, uy, lengths = -ux, -uy, [-length for length in lengths]
    return TrackLine((x, y), heading, (x + lengths[-1] * ux, y + lengths[-1] * uy))


def _way(start: float, speed: float, limits: tuple[float, float]) -> float:
    """Length along the line until one coordinate reaches its limit."""
    if speed == 0.0:
        return inf
    return ((limits[1] if speed > 0 else limits[0]) - start) / speed


def _inward(place: Place, area: Area) -> float:
    """Heading [rad] of the inward normal of the wall nearest to a place."""
    walls = ((place[0] - area.x_m[0], 0.0), (area.x_m[1] - place[0], pi),
             (place[1] - area.y_m[0], 0.5 * pi), (area.y_m[1] - place[1], -0.5 * pi))
    return min(walls)[1]
