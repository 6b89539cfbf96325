"""Targets for `chase`: on a given path, fleeing to the boundary of the field of view, or wandering.

A member has one verb: `moved(dt_s, pursuer)` moves it by dt, given the pursuer's place, and returns its new place.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, hypot, pi, remainder, sin
from typing import Protocol

import numpy as np

from agents.estimation.paths import STEP_NS, Path
from agents.pursuit import Place
from agents.pursuit.law import Area


class Evader(Protocol):
    @property
    def place(self) -> Place: ...

    def moved(self, dt_s: float, pursuer: Place) -> Place: ...


class OnPath:
    """Moves along straight lines between the instants of a path; stays at its end."""

    def __init__(self, path: Path) -> None:
        self._xs, self._ys = path.x.tolist(), path.y.tolist()
        self._t_s = 0.0
        self.place: Place = (self._xs[0], self._ys[0])

    def moved(self, dt_s: float, pursuer: Place) -> Place:
        self._t_s += dt_s
        at = self._t_s / (STEP_NS * 1e-9) + 1e-9                # 1e-9 exceeds the rounding error of the sum
        k = min(int(at), len(self._xs) - 2)
        share = min(max(at - k - 1e-9, 0.0), 1.0)
        self.place = (self._xs[k] + share * (self._xs[k + 1] - self._xs[k]),
                      self._ys[k] + share * (self._ys[k + 1] - self._ys[k]))
        return self.place


class Runner:
    """Flees straight away from the pursuer at full speed; it turns instantly and stops at the area's boundary."""

    def __init__(self, place: Place, v_max_mps: float, rng: np.random.Generator, area: Area | None = None) -> None:
        self.place = place
        self._v_max_mps = v_max_mps
        self._area = area
        angle = rng.uniform(0, 2 * np.pi)
        self._last: Place = (cos(angle), sin(angle))            # direction used while both are at the same place

    def moved(self, dt_s: float, pursuer: Place) -> Place:
        dx, dy = self.place[0] - pursuer[0], self.place[1] - pursuer[1]
        away = hypot(dx, dy)
        if away > 1e-9:
            self._last = dx / away, dy / away
        way = self._v_max_mps * dt_s
        self.place = self.place[0] + way * self._last[0], self.place[1] + way * self._last[1]
        if self._area:
            self.place = self._area.nearest(self.place)
        return self.place


class Wanderer:
    """A unicycle that drives to one waypoint after the other (section 3.3.2) and stays at the last one.

    It turns at omega_max, without lag, and slows down for a waypoint aside: v = max(0, v_max cos(bearing)).
    """

    NEAR_M = 0.1

    def __init__(self, place: Place, waypoints: Sequence[Place], v_max_mps: float = 0.7,
                 omega_max_radps: float = 1.5) -> None:
        self.place = place
        self._left = list(waypoints)
        self._v_max_mps = v_max_mps
        self._omega_max_radps = omega_max_radps
        self._heading_rad = 0.0

    def moved(self, dt_s: float, pursuer: Place) -> Place:
        while self._left and hypot(self._left[0][0] - self.place[0], self._left[0][1] - self.place[1]) < self.NEAR_M:
            del self._left[0]
        if self._left:
            x, y = self.place
            bearing = remainder(atan2(self._left[0][1] - y, self._left[0][0] - x) - self._heading_rad, 2 * pi)
            turn = self._omega_max_radps * dt_s
            self._heading_rad += max(-turn, min(turn, bearing))
            way = self._v_max_mps * max(0.0, cos(bearing)) * dt_s
            self.place = x + way * cos(self._heading_rad), y + way * sin(self._heading_rad)
        return self.place
