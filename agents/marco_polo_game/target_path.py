"""The way of a target through the area (section 2.4): straight legs of one speed, drawn from one random stream.

    place      uniform on the boundary           heading    uniform within +-pi/2 of the wall's inward normal
    speed      uniform in [least, greatest]      leg        lasts a time uniform in [T_min, T_max]
    turn       the new heading is uniform within +-pi/2 of the *first* heading

The target leaves where a leg meets the boundary. Source: dissertation, (2.2), (2.3) and section 2.4.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, pi, sin
from random import Random

from agents.marco_polo.game_parameters import GameParameters
from agents.marco_polo.track_line import TrackLine
from agents.pursuit import Place
from agents.pursuit.law import Area


@dataclass(frozen=True)
class Leg:
    place: Place                # where it begins [m]
    heading_rad: float
    off_rad: float              # from the target's first heading, -pi/2 to pi/2
    speed_mps: float
    lasts_ns: int               # at least 1
    leaves: bool                # it ends at the boundary, and the target leaves there

    @property
    def velocity_mps(self) -> Place:
        return self.speed_mps * cos(self.heading_rad), self.speed_mps * sin(self.heading_rad)

    @property
    def end(self) -> Place:
        """Return the place [m] at which the leg ends."""
        vx, vy = self.velocity_mps
        return self.place[0] + vx * self.lasts_ns * 1e-9, self.place[1] + vy * self.lasts_ns * 1e-9


class TargetPath:
    def __init__(self, area: Area, parameters: GameParameters, rng: Random) -> None:
        self._area, self._parameters, self._rng = area, parameters, rng
        self._speed_mps = rng.uniform(parameters.target_least_mps, parameters.target_greatest_mps)
        place, inward_rad = entrance(area, rng.random())
        self._first_rad = inward_rad + rng.uniform(-0.5 * pi, 0.5 * pi)
        self.leg = self._leg(place, 0.0)

    def turn(self) -> Leg:
        """Begin the next leg where the last one ended, and return it."""
        self.leg = self._leg(self._area.nearest(self.leg.end), self._rng.uniform(-0.5 * pi, 0.5 * pi))
        return self.leg

    def _leg(self, place: Place, off_rad: float) -> Leg:
        heading_rad = self._first_rad + off_rad
        exit_place = TrackLine(place, heading_rad, place).exit_point(self._area)
        to_exit_s = hypot(exit_place[0] - place[0], exit_place[1] - place[1]) / self._speed_mps
        turn_ns = self._rng.randint(self._parameters.turn_least_ns, self._parameters.turn_greatest_ns)
        to_exit_ns = max(1, round(to_exit_s * 1e9))
        return Leg(place, heading_rad, off_rad, self._speed_mps, min(turn_ns, to_exit_ns), to_exit_ns <= turn_ns)


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
