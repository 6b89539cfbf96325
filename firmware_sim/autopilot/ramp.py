"""Reference between targets: upon a new target a ramp with bounded speed and acceleration, for a smooth trajectory.

    v_wanted = k d             d <= a / k^2            d the way that is left
               sqrt(2 a (d - a / 2 k^2))  beyond       braking at a, ends without a kink, at most v_max
    dv/dt towards v_wanted, at most 1.5 a              dp/dt = v

One `Ramp` is one axis or several that turn together: their speed and acceleration are bounded as those of a vector.
A target may change at any instant; without one on an axis the axis follows a velocity.

Source: the ramp of Tolic 2012, section 3.5 (Figure 3.11), whose shape is not printed; the law of speed over way is that
of ArduPilot's square-root controller.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, sqrt

K_NEAR = 2.0        # [1/s] of speed over way near the target
CATCH_UP = 1.5      # how much harder than it brakes it may turn or catch up


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
        """Go on for `dt_s`: towards `target` where there is one, else at `velocity`, else to a stand."""
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
        """Let the reference be at most `length_m` from the vehicle, so that it does not run away from a blocked one."""
        way = [self.position[i] - actual[i] for i in range(len(actual))]
        distance = hypot(*way)
        if distance > length_m:
            self.position = [actual[i] + way[i] * length_m / distance for i in range(len(actual))]
