"""Dead reckoning: the robot's pose from the angles that its wheels have turned.

Between two readings the wheels are assumed to turn at constant speed, so the robot drives an arc:

    d = r (dl + dr) / 2,   dtheta = r (dr - dl) / b
    (x, y) += d sinc(dtheta / 2) (cos, sin)(theta + dtheta / 2)         sinc(a) = sin(a) / a

After the last reading the pose is extrapolated along that arc. At a reading the heading is exact; the position differs
from the true one as the true path differs from arcs.
Source: Siegwart and Nourbakhsh 2004, section 5.2.4 (odometry), with the exact arc in place of its secant.
Not modelled: slip, which encoders do not measure.
"""

from __future__ import annotations

from math import isfinite

from agents.tracking.arcs import arc
from agents.tracking.controller import Command, Pose


class DeadReckoning:
    def __init__(self, wheel_radius_m: float, track_m: float, start: Pose = Pose(0.0, 0.0, 0.0)) -> None:
        for name, value in (("wheel_radius_m", wheel_radius_m), ("track_m", track_m)):
            if not (isfinite(value) and value > 0):
                raise ValueError(f"{name}={value}: expected more than 0")
        self._radius_m, self._track_m = wheel_radius_m, track_m
        self._pose = start
        self._at_ns: int | None = None
        self._angles = 0.0, 0.0
        self._speeds = 0.0, 0.0         # of the left and the right wheel over the last interval [rad/ns]

    def read(self, at_ns: int, left_rad: float, right_rad: float) -> None:
        """Take the wheels' angles at `at_ns`; the first reading is the start. Drops a reading older than the last."""
        if self._at_ns is not None:
            elapsed_ns = at_ns - self._at_ns
            if elapsed_ns <= 0:
                return
            turned = left_rad - self._angles[0], right_rad - self._angles[1]
            self._pose = self._after(*turned)
            self._speeds = turned[0] / elapsed_ns, turned[1] / elapsed_ns
        self._at_ns = at_ns
        self._angles = left_rad, right_rad

    def pose_at(self, at_ns: int) -> Pose:
        """Return the pose at `at_ns`, extrapolated along the last arc from the last reading, forwards or backwards."""
        if self._at_ns is None:
            return self._pose
        since_ns = at_ns - self._at_ns
        return self._after(self._speeds[0] * since_ns, self._speeds[1] * since_ns)

    def _after(self, left_rad: float, right_rad: float) -> Pose:
        way_m = self._radius_m * (left_rad + right_rad) / 2
        turn_rad = self._radius_m * (right_rad - left_rad) / self._track_m
        return arc(self._pose, Command(way_m, turn_rad), 1.0)
