"""Motions of evader robots: each computes the plant's command from time, own pose and, for runners, the pursuer.

    circle      v = 0.55 (1 + 0.05 sin(2 pi t / 11)), omega = 2 pi / 55 (1 + 0.05 cos(2 pi t / 7))      section 3.3.1
    zig_zag     3.4 s at v = 0.7, then 1.5 s at v = -0.4 with omega = +-1.5, alternating                section 3.3.1
    waypoints   drives to one random point of the area after the other, v = v_max cos(bearing)          section 3.3.2
    runner      drives straight away from its pursuer, forwards or backwards
    free_runner moves straight away from its pursuer at full speed, without turning first
    erratic     as if steered by hand: random manoeuvres (move, turn, halt) at full speed               section 3.5

Speeds of circle and zig-zag are for v_max = 0.7 and scale with it. The first four command a unicycle (v, omega), the
last two an omnidirectional robot (velocity in the world, omega). `erratic` returns when it has left the area.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import atan2, cos, hypot, pi, remainder, sin
from random import Random
from typing import ClassVar

from agents.pursuit import Place
from agents.pursuit.law import Area
from agents.tracking.controller import Pose

PATH_SPEED_MPS = 0.7            # v_max of section 3.3.1
OMEGA_MAX_RADPS = 1.5
NEAREST_M = 1e-9                # nearer than this the direction to the pursuer means nothing
MANOEUVRES = ("forwards", "forwards", "backwards", "left", "right", "aslant", "turn", "curve", "stand")
UNICYCLE, OMNIDIRECTIONAL = ("v_cmd", "omega_cmd"), ("v_x_cmd", "v_y_cmd", "omega_cmd")


@dataclass(frozen=True)
class Driver:
    """The arguments from which a motion is made."""

    v_max_mps: float
    area: Area
    rng: Random


@dataclass
class Motion(ABC):
    INPUTS: ClassVar[tuple[str, ...]] = UNICYCLE        # names of the plant's inputs
    SEES_PURSUER: ClassVar[bool] = False
    driver: Driver

    @abstractmethod
    def command(self, t_s: float, own: Pose, pursuer: Place | None) -> Sequence[float]:
        """Return one value for each of INPUTS, held until the next call."""


class Circle(Motion):
    def command(self, t_s: float, own: Pose, pursuer: Place | None) -> Sequence[float]:
        scale = self.driver.v_max_mps / PATH_SPEED_MPS
        return (scale * 0.55 * (1 + 0.05 * sin(2 * pi * t_s / 11)),
                2 * pi / 55 * (1 + 0.05 * cos(2 * pi * t_s / 7)))


class ZigZag(Motion):
    def command(self, t_s: float, own: Pose, pursuer: Place | None) -> Sequence[float]:
        scale = self.driver.v_max_mps / PATH_SPEED_MPS
        period, into_s = divmod(t_s, 3.4 + 1.5)
        if into_s < 3.4:
            return scale * 0.7, 0.0
        return scale * -0.4, 1.5 if period % 2 == 0 else -1.5


@dataclass
class Waypoints(Motion):
    goal: Place | None = None

    def command(self, t_s: float, own: Pose, pursuer: Place | None) -> Sequence[float]:
        while self.goal is None or hypot(self.goal[0] - own.x_m, self.goal[1] - own.y_m) < 0.2:
            (x0, x1), (y0, y1) = self.driver.area.x_m, self.driver.area.y_m
            self.goal = self.driver.rng.uniform(x0, x1), self.driver.rng.uniform(y0, y1)
        return _towards(own, self.goal, self.driver.v_max_mps)


class Runner(Motion):
    SEES_PURSUER = True

    def command(self, t_s: float, own: Pose, pursuer: Place | None) -> Sequence[float]:
        if pursuer is None:
            return 0.0, 0.0
        away = own.x_m + (own.x_m - pursuer[0]), own.y_m + (own.y_m - pursuer[1])
        bearing = remainder(atan2(away[1] - own.y_m, away[0] - own.x_m) - own.theta_rad, 2 * pi)
        aside = remainder(bearing, pi)              # bearing from the nearer end, front or rear, of the robot
        return self.driver.v_max_mps * cos(bearing), max(-OMEGA_MAX_RADPS, min(OMEGA_MAX_RADPS, 2 * aside))


@dataclass
class FreeRunner(Motion):
    """Until it knows in which direction its pursuer is, it moves in a random one."""

    INPUTS: ClassVar[tuple[str, ...]] = OMNIDIRECTIONAL
    SEES_PURSUER = True
    direction: Place | None = field(default=None)           # unit vector

    def command(self, t_s: float, own: Pose, pursuer: Place | None) -> Sequence[float]:
        dx, dy = (0.0, 0.0) if pursuer is None else (own.x_m - pursuer[0], own.y_m - pursuer[1])
        if (away := hypot(dx, dy)) > NEAREST_M:
            self.direction = dx / away, dy / away
        elif self.direction is None:
            angle = self.driver.rng.uniform(-pi, pi)
            self.direction = cos(angle), sin(angle)
        return self.driver.v_max_mps * self.direction[0], self.driver.v_max_mps * self.direction[1], 0.0


@dataclass
class Erratic(Motion):
    """Random manoeuvres; each lasts 0.4 s plus an exponentially distributed time of mean 1.6 s."""

    INPUTS: ClassVar[tuple[str, ...]] = OMNIDIRECTIONAL
    until_s: float = 0.0
    direction_rad: float | None = field(default=None)       # in the robot's frame; None: no translation
    omega_radps: float = 0.0

    def command(self, t_s: float, own: Pose, pursuer: Place | None) -> Sequence[float]:
        rng = self.driver.rng
        if t_s >= self.until_s:
            self.until_s = t_s + 0.4 + rng.expovariate(1 / 1.6)
            kind = rng.choice(MANOEUVRES)
            self.direction_rad = {"forwards": 0.0, "backwards": pi, "left": pi / 2, "right": -pi / 2, "curve": 0.0,
                                  "aslant": rng.uniform(-pi, pi)}.get(kind)
            self.omega_radps = rng.choice((-OMEGA_MAX_RADPS, OMEGA_MAX_RADPS)) if kind in ("turn", "curve") else 0.0
        home = self.driver.area.nearest((own.x_m, own.y_m))
        if home != (own.x_m, own.y_m):
            angle = atan2(home[1] - own.y_m, home[0] - own.x_m)
        elif self.direction_rad is None:
            return 0.0, 0.0, self.omega_radps
        else:
            angle = own.theta_rad + self.direction_rad
        return self.driver.v_max_mps * cos(angle), self.driver.v_max_mps * sin(angle), self.omega_radps


MOTIONS: dict[str, type[Motion]] = {
    "circle": Circle,
    "erratic": Erratic,
    "free_runner": FreeRunner,
    "runner": Runner,
    "waypoints": Waypoints,
    "zig_zag": ZigZag,
}


def _towards(own: Pose, goal: Place, v_max_mps: float) -> tuple[float, float]:
    bearing = remainder(atan2(goal[1] - own.y_m, goal[0] - own.x_m) - own.theta_rad, 2 * pi)
    return v_max_mps * max(0.0, cos(bearing)), max(-OMEGA_MAX_RADPS, min(OMEGA_MAX_RADPS, 2 * bearing))
