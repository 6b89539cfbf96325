"""PD attitude control of a rigid body: torques from the attitude error and the error of the body rates.

    e = 2 sign(w) (x, y, z) of conj(q) q_target        torque = J (k_angle e + k_rate (rates_target - rates))

To first order, e is the rotation about the body's axes to the target; its direction is right up to half a turn. Yaw,
for which the rotors are weak, has its own gains, and its error is clipped to `YAW_MOST`, so that a large turn does not
saturate the motors.

Source: Michael et al. 2010, The GRASP multiple micro-UAV testbed (PD on the angles), with the quaternion's error of
Fresk, Nikolakopoulos 2013 instead of Euler angles.
"""

from __future__ import annotations

from firmware_sim.autopilot.airframe import Airframe
from firmware_sim.autopilot.vehicle import Quaternion, Vector

YAW_MOST = 0.5      # [rad]


class AttitudeControl:
    def __init__(self, airframe: Airframe) -> None:
        self._inertia = airframe.inertia_kgm2
        self.k_angle, self.k_rate, self.k_yaw, self.k_yaw_rate = 0.0, 0.0, 0.0, 0.0

    def torque(self, q: Quaternion, rates: Vector, target: Quaternion, rates_target: Vector) -> Vector:
        """Return the torque [N m] that turns the body from `q` to `target`."""
        w, x, y, z = q
        tw, tx, ty, tz = target
        twice = 2.0 if w * tw + x * tx + y * ty + z * tz >= 0 else -2.0
        ez = twice * (w * tz - x * ty + y * tx - z * tw)
        ez = YAW_MOST if ez > YAW_MOST else -YAW_MOST if ez < -YAW_MOST else ez
        jx, jy, jz = self._inertia
        k_angle, k_rate = self.k_angle, self.k_rate
        return (jx * (k_angle * twice * (w * tx - x * tw - y * tz + z * ty) + k_rate * (rates_target[0] - rates[0])),
                jy * (k_angle * twice * (w * ty + x * tz - y * tw - z * tx) + k_rate * (rates_target[1] - rates[1])),
                jz * (self.k_yaw * ez + self.k_yaw_rate * (rates_target[2] - rates[2])))

    def rate_torque(self, rates: Vector, rates_target: Vector) -> Vector:
        """Return the torque [N m] that turns the body at `rates_target`, whatever its attitude."""
        jx, jy, jz = self._inertia
        return (jx * self.k_rate * (rates_target[0] - rates[0]), jy * self.k_rate * (rates_target[1] - rates[1]),
                jz * self.k_yaw_rate * (rates_target[2] - rates[2]))
