"""The way of a target through the area (section 2.4): straight legs of one speed, drawn from one random stream.

    place      uniform on the boundary, if outside obstacles   heading  uniform within +-pi/2 of the inward normal
    speed      uniform in [least, greatest]                    leg      lasts a time uniform in [T_min, T_max]
    turn       the new heading is uniform within +-pi/2 of the *first* heading
    obstacle   a leg that meets one ends there, and the target turns into a heading whose next `platform_m` are free:
               a uniform one of those within +-pi/2 of the first heading (multiples of 5 degrees), else the one closest
               to that half plane; the `TRAPPED`th time in a row any free heading, since a corner that is open
               backwards only would hold the target for ever. The time to the next turn is drawn anew

The target leaves where a leg meets the boundary. It may enter zones. Source: dissertation, (2.2), (2.3), section 2.4;
section 3.4 has it that an evader makes "abrupt changes" at an obstacle, and does not say which.
Not modelled: the size of a target, which is a point that may slide along obstacles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from math import cos, hypot, inf, pi, radians, sin
from random import Random
from typing import Final

from agents.marco_polo.cells import Polygon
from agents.marco_polo.convex_polygon import ConvexPolygon
from agents.marco_polo.game_parameters import GameParameters
from agents.marco_polo.track_line import TrackLine
from agents.pursuit import Place
from agents.pursuit.law import Area

TRAPPED: Final = 4
FANS: Final = (5.0, 0.5)        # degrees between the headings that a target at an obstacle tries; narrow gaps need more


class Ending(Enum):
    """The ways in which a leg of a target can end."""

    TURNS = "turns"             # as (2.3) has it
    AVOIDS = "avoids"           # turns at an obstacle
    LEAVES = "leaves"           # at the boundary


@dataclass(frozen=True)
class Leg:
    place: Place                # where it begins [m]
    heading_rad: float
    off_rad: float              # from the target's first heading, -pi/2 to pi/2 but after an obstacle
    speed_mps: float
    lasts_ns: int               # at least 1
    ending: Ending

    @property
    def velocity_mps(self) -> Place:
        return self.speed_mps * cos(self.heading_rad), self.speed_mps * sin(self.heading_rad)

    @property
    def end(self) -> Place:
        """Return the place [m] at which the leg ends."""
        vx, vy = self.velocity_mps
        return self.place[0] + vx * self.lasts_ns * 1e-9, self.place[1] + vy * self.lasts_ns * 1e-9


class TargetPath:
    def __init__(self, area: Area, parameters: GameParameters, rng: Random, obstacles: Sequence[Polygon] = ()) -> None:
        """`obstacles` leave a part of the boundary free (`checks.check_entrances`)."""
        self._area, self._parameters, self._rng = area, parameters, rng
        self._obstacles = [ConvexPolygon(corners) for corners in obstacles]
        self._speed_mps = rng.uniform(parameters.target_least_mps, parameters.target_greatest_mps)
        place, inward_rad = entrance(area, rng.random())
        while any(obstacle.depth_m(place) >= 0.0 for obstacle in self._obstacles):
            place, inward_rad = entrance(area, rng.random())
        self._first_rad = inward_rad + rng.uniform(-0.5 * pi, 0.5 * pi)
        self._avoided = 0                       # turns at obstacles since the last other one
        self.leg = self._leg(place, 0.0)

    def turn(self) -> Leg:
        """Begin the next leg where the last one ended, and return it."""
        place = self._area.nearest(self.leg.end)
        if self.leg.ending is Ending.AVOIDS:
            self._avoided += 1
            off_rad = self._away(place)
        else:
            self._avoided = 0
            off_rad = self._rng.uniform(-0.5 * pi, 0.5 * pi)
        self.leg = self._leg(place, off_rad)
        return self.leg

    def _leg(self, place: Place, off_rad: float) -> Leg:
        heading_rad = self._first_rad + off_rad
        exit_place = TrackLine(place, heading_rad, place).exit_point(self._area)
        to_exit_s = hypot(exit_place[0] - place[0], exit_place[1] - place[1]) / self._speed_mps
        turn_ns = self._rng.randint(self._parameters.turn_least_ns, self._parameters.turn_greatest_ns)
        ends = [(max(1, round(to_exit_s * 1e9)), Ending.LEAVES), (turn_ns, Ending.TURNS)]
        if (free_m := self._free_m(place, heading_rad)) < inf:
            ends.insert(0, (max(1, round(free_m / self._speed_mps * 1e9)), Ending.AVOIDS))
        lasts_ns, ending = min(ends, key=lambda end: end[0])
        return Leg(place, heading_rad, off_rad, self._speed_mps, lasts_ns, ending)

    def _free_m(self, place: Place, heading_rad: float) -> float:
        return min((obstacle.way_m(place, heading_rad) for obstacle in self._obstacles), default=inf)

    def _away(self, place: Place) -> float:
        """Draw a heading, relative to the first one, that leads away from an obstacle at `place`."""
        for step_deg in FANS:
            count = round(360.0 / step_deg)
            offs = [radians((number + 0.5) * step_deg - 180.0) for number in range(count)]
            free = [off for off in offs if self._free_m(place, self._first_rad + off) >= self._parameters.platform_m]
            if free and self._avoided % TRAPPED == 0:
                return self._rng.choice(free)
            if forward := [off for off in free if abs(off) < 0.5 * pi]:
                return self._rng.choice(forward)
            if free:
                least = min(abs(off) for off in free)
                return self._rng.choice([off for off in free if abs(off) < least + 1e-9])
        return max(offs, key=lambda off: self._free_m(place, self._first_rad + off))


def entrance(area: Area, share: float) -> tuple[Place, float]:
    """Return the place on the boundary after `share` (0 to 1) of its length, and the inward normal's heading [rad].

    Counterclockwise from the corner with the least x and y."""
    (west, east), (south, north) = area.x_m, area.y_m
    width, height = east - west, north - south
    along = share * 2.0 * (width + height)
    for length, heading_rad, start, (ux, uy) in ((width, 0.5 * pi, (west, south), (1, 0)),
                                                 (height, pi, (east, south), (0, 1)),
                                                 (width, -0.5 * pi, (east, north), (-1, 0))):
        if along < length:
            return (start[0] + ux * along, start[1] + uy * along), heading_rad
        along -= length
    return (west, north - along), 0.0
