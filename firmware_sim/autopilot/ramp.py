"""Reference between targets: a ramp with bounded speed and acceleration to each new target, for a smooth trajectory.

    v_wanted = k d             d <= a / k^2            d: remaining distance
               sqrt(2 a (d - a / 2 k^2))  beyond       braking at a; continuous slope; at most v_max
    dv/dt towards v_wanted, at most 1.5 a              dp/dt = v

One `Ramp` has one axis, or several whose speed and acceleration are bounded as those of a vector. A target may change
at any instant; an axis without a target follows a velocity.

Source: the ramp of Tolic 2012, section 3.5 (Figure 3.11), whose shape is not printed; the law of speed over distance is
that of ArduPilot's square-root controller.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, sqrt

K_NEAR = 2.0        # [1/s] k, speed per distance near the target
CATCH_UP = 1.5      # ratio of the largest acceleration to the braking one, for turning and catching up


class Ramp:
    def __init__(self, axes: int) -> None:
        self.position = [0.0] * axes
        self.velocity = [0.0] * axes
        self.acceleration = [0.0] * axes

    def restart(self, position: Sequence[float], velocity: Sequence[float]) -> None:
        self.position, self.velocity = list(position), list(velocity)
        self.acceleration = [0.0] * len(self.position)

    def step(self, target: Sequence[float | None], velocity: Sequence[float | None], speed_max: float, accel: float,
             dt_s: float) -> None:
        """Advance by `dt_s`: each axis to its `target` if there is one, else at its `velocity`, else to a stop."""
        axes = range(len(self.position))
        way = [0.0 if (goal := target[i]) is None else goal - self.position[i] for i in axes]
        left = hypot(*way)
        near = accel / (K_NEAR * K_NEAR)
        pull = K_NEAR if left <= near else sqrt(2 * accel * (left - near / 2)) / left
        wanted = [pull * way[i] + (velocity[i] or 0.0) for i in axes]
        fast = hypot(*wanted)
        if fast > speed_max:
            wanted = [each * speed_max / fast for each in wanted]
        change = [wanted[i] - self.velocity[i] for i in axes]
        size, most = hypot(*change), CATCH_UP * accel * dt_s
        share = most / size if size > most else 1.0
        for i in axes:
            step = change[i] * share
            self.acceleration[i] = step / dt_s
            self.position[i] += (self.velocity[i] + step / 2) * dt_s
            self.velocity[i] += step

    def leash(self, actual: Sequence[float], length_m: float) -> None:
        """Limit the reference's distance from the vehicle to `length_m`, in case the vehicle is blocked."""
        way = [self.position[i] - actual[i] for i in range(len(actual))]
        distance = hypot(*way)
        if distance > length_m:
            self.position = [actual[i] + way[i] * length_m / distance for i in range(len(actual))]
