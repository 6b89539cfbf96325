"""A controller for tests: holds a height and a level attitude; its numbers are those of the Hummingbird."""

from __future__ import annotations

from math import sqrt

MASS_KG, G, ARM_M = 0.5, 9.81, 0.175
K_THRUST, K_MOMENT = 5.571652e-6, 1.367836e-7
MOTOR_MIN, MOTOR_MAX = 125.66371, 816.81409
INERTIA = (2.32e-3, 2.32e-3, 4.0e-3)
BANDWIDTH = 3.0             # of the height loop [rad/s]; well below the motors' 20 rad/s
ATTITUDE_BANDWIDTH = 8.0


def commands(height_m: float, climb_mps: float, quaternion, rates, goal_m: float) -> list[float]:
    """Return the commands of the channels right, left, front, back, as PX4 and ArduPilot number a plus frame."""
    lift = MASS_KG * (G + BANDWIDTH**2 * (goal_m - height_m) - 2 * BANDWIDTH * climb_mps)
    lift = min(max(lift, 0.3 * MASS_KG * G), 1.5 * MASS_KG * G)
    w, x, y, _ = quaternion
    sign = 1.0 if w >= 0 else -1.0
    torque = [inertia * (-2 * sign * ATTITUDE_BANDWIDTH**2 * angle - 2 * ATTITUDE_BANDWIDTH * rate)
              for inertia, angle, rate in zip(INERTIA, (x, y, 0.0), rates, strict=True)]
    roll, pitch, yaw = torque[0] / (2 * ARM_M), torque[1] / (2 * ARM_M), torque[2] * K_THRUST / (4 * K_MOMENT)
    front, back = lift / 4 + pitch - yaw, lift / 4 - pitch - yaw
    left, right = lift / 4 + roll + yaw, lift / 4 - roll + yaw
    return [(sqrt(max(force, 0.0) / K_THRUST) - MOTOR_MIN) / (MOTOR_MAX - MOTOR_MIN)
            for force in (right, left, front, back)]
