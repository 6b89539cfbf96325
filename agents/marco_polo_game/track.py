"""The track that a sensor keeps of one target: the newest detection by each sensor, and the place that they predict.

Independent detections are those of different sensors, so their number is the number of sensors that have detected the
target; a sensor that sees it again replaces its own detection. Until it leaves along the track line, the target is
expected at

    p(t) = last + v (t - seen) u        v: distance between oldest and newest detection over the time between them,
                                           at least the least and at most the greatest speed of a target
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import cos, dist, sin
from typing import NamedTuple

from agents.marco_polo.game_parameters import GameParameters
from agents.marco_polo.track_line import TrackLine, fit_track
from agents.pursuit import Place
from agents.pursuit.law import Area

STEP_NS = 100_000_000           # of the search for an intercept
SAME_PLACE_M = 1e-6


class Seen(NamedTuple):
    at_ns: int
    place: Place


@dataclass(frozen=True)
class Forecast:
    """Motion of a target along its track line from its newest detection on."""

    track: TrackLine
    seen_ns: int
    speed_mps: float
    exit_place: Place           # where it leaves the area [m]

    @property
    def leaves_ns(self) -> int:
        """Return when the target is expected to leave the area."""
        return self.seen_ns + round(dist(self.track.last, self.exit_place) / self.speed_mps * 1e9)

    def place(self, at_ns: int) -> Place:
        """Return where it is expected [m] at `at_ns`, the exit afterwards."""
        if at_ns >= self.leaves_ns:
            return self.exit_place
        way = self.speed_mps * (at_ns - self.seen_ns) * 1e-9
        return (self.track.last[0] + way * cos(self.track.heading_rad),
                self.track.last[1] + way * sin(self.track.heading_rad))

    def intercept(self, own: Place, speed_mps: float, now_ns: int) -> Place:
        """Return the first place, to `STEP_NS`, where a sensor at `own` is no later than the target; else the exit."""
        for at_ns in range(now_ns, self.leaves_ns, STEP_NS):
            place = self.place(at_ns)
            if dist(own, place) <= speed_mps * (at_ns - now_ns) * 1e-9:
                return place
        return self.exit_place


@dataclass
class Track:
    area: Area
    parameters: GameParameters
    seen: dict[str, Seen] = field(default_factory=dict)     # by sensor
    sight: Seen | None = None                               # this sensor's newest sight
    out_of_view_ns: dict[str, int] = field(default_factory=dict)    # exposure at which another sensor lost sight of it
    investigated: bool = False                              # its investigation is over: it has k detections
    captured: bool = False

    @property
    def detections(self) -> int:
        return len(self.seen)

    def detected(self, sensor: str, seen: Seen) -> bool:
        """Take a detection; return whether it is the first one by this sensor."""
        known = self.seen.get(sensor)
        if known is None or seen.at_ns > known.at_ns:
            self.seen[sensor] = Seen(seen.at_ns, self.area.nearest(seen.place))
        return known is None

    def forecast(self) -> Forecast:
        """Return the expected motion; ValueError without any detection."""
        order = sorted({*self.seen.values(), *([self.sight] if self.sight else [])})
        places: list[Place] = []
        for _, place in order:
            if all(dist(place, other) > SAME_PLACE_M for other in places):
                places.append(place)
        track = fit_track(places, self.area)
        track = replace(track, last=self.area.nearest(track.last))
        return Forecast(track, order[-1].at_ns, self._speed_mps(order[0], order[-1]), track.exit_point(self.area))

    def _speed_mps(self, first: Seen, last: Seen) -> float:
        least, greatest = self.parameters.target_least_mps, self.parameters.target_greatest_mps
        if last.at_ns == first.at_ns:
            return 0.5 * (least + greatest)
        speed = dist(first.place, last.place) / ((last.at_ns - first.at_ns) * 1e-9)
        return min(max(speed, least), greatest)
