"""Position control: thrust and attitude by PID on the position, with feedforward of the ramp's acceleration and drag.

    a = a_ff + k_p (p_ref - p) + k_d (v_ref - v) + i          di/dt = k_i (p_ref - p), bounded
    f = a - g                                                  specific force; the body's z axis points along -f

The tilt is bounded, and f always points up. The integral compensates unknown forces: wind, a wrong mass; its horizontal
part is frozen while the tilt is at its bound. All vectors are NED.

Source: Michael et al. 2010, The GRASP multiple micro-UAV testbed (PD with feedforward on trajectories, PID at
hover); projection of the thrust on the body's axis as in Mellinger, Kumar 2011.
"""

from __future__ import annotations

from math import sqrt

from firmware_sim.autopilot.airframe import GRAVITY
from firmware_sim.autopilot.frames import down_axis, tilted
from firmware_sim.autopilot.vehicle import Quaternion, Vector

LEAST_LIFT = 0.3            # least vertical specific force, as a share of gravity
INTEGRAL_MOST = 4.0         # [m/s2] bound of the integral


class PositionControl:
    def __init__(self, mass_kg: float) -> None:
        self._mass_kg = mass_kg
        self.kp = self.kd = self.ki = 0.0               # horizontal
        self.kp_z = self.kd_z = self.ki_z = 0.0
        self.tan_tilt = 0.0                             # tangent of the largest tilt
        self._integral = [0.0, 0.0, 0.0]

    def restart(self) -> None:
        self._integral = [0.0, 0.0, 0.0]

    @property
    def lift_spared(self) -> float:
        """Difference [m/s2] of the lift for the known mass from the needed lift, as the integral has found it."""
        return self._integral[2]

    def step(self, error: Vector, error_v: Vector, feed_forward: Vector, yaw_ref: float, q: Quaternion,
             dt_s: float | None) -> tuple[Quaternion, float]:
        """Return attitude and thrust [N] for the errors (reference - actual); without `dt_s` the integral is frozen."""
        integral = self._integral
        fx = feed_forward[0] + self.kp * error[0] + self.kd * error_v[0] + integral[0]
        fy = feed_forward[1] + self.kp * error[1] + self.kd * error_v[1] + integral[1]
        fz = min(-LEAST_LIFT * GRAVITY,
                 feed_forward[2] + self.kp_z * error[2] + self.kd_z * error_v[2] + integral[2] - GRAVITY)
        aside, most = sqrt(fx * fx + fy * fy), -self.tan_tilt * fz
        if aside > most:
            fx, fy = fx * most / aside, fy * most / aside
        if dt_s is not None:
            self._integrate(error, dt_s, aside > most)
        size = sqrt(fx * fx + fy * fy + fz * fz)
        target = tilted((-fx / size, -fy / size, -fz / size), yaw_ref)
        dx, dy, dz = down_axis(q)
        return target, max(0.0, -self._mass_kg * (fx * dx + fy * dy + fz * dz))

    def _integrate(self, error: Vector, dt_s: float, tilt_at_bound: bool) -> None:
        for i, ki in ((2, self.ki_z),) if tilt_at_bound else ((0, self.ki), (1, self.ki), (2, self.ki_z)):
            grown = self._integral[i] + ki * error[i] * dt_s
            self._integral[i] = max(-INTEGRAL_MOST, min(INTEGRAL_MOST, grown))
