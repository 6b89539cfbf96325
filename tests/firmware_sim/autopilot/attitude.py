"""An attitude from its angles, by SciPy."""

from __future__ import annotations

from scipy.spatial.transform import Rotation

from firmware_sim.autopilot.vehicle import Quaternion


def from_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> Quaternion:
    w, x, y, z = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_quat(scalar_first=True).tolist()
    return w, x, y, z
