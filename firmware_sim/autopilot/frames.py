"""Conversion from the plant's coordinate frames to MAVLink's, and the rotations that a flight controller uses.

    plant      world x east, y north, z up        body x ahead, y left,  z up
    MAVLink    world north, east, down (NED)      body x ahead, y right, z down (FRD)

    q_ned = q(pi about (1, 1, 0)) * q_plant * q(pi about x)

Source: REP 103 (Foote, Purvis 2010) for the plant's side, MAVLink common.xml for the other. Quaternions are
(w, x, y, z) and turn body vectors into world vectors.
"""

from __future__ import annotations

from math import asin, atan2, cos, pi, remainder, sin, sqrt

from firmware_sim.autopilot.vehicle import Quaternion, Vector

_HALF = sqrt(0.5)


def ned_of(x: float, y: float, z: float) -> Vector:
    """Convert a world vector between the plant's frame and NED; the function is its own inverse."""
    return y, x, -z


def frd_of(x: float, y: float, z: float) -> Vector:
    """Convert a body vector between the plant's frame and FRD; the function is its own inverse."""
    return x, -y, -z


def ned_quaternion(w: float, x: float, y: float, z: float) -> Quaternion:
    """Convert an attitude between the plant's frames and MAVLink's; the function is its own inverse."""
    return _HALF * (w + z), _HALF * (x + y), _HALF * (x - y), _HALF * (w - z)


def yaw_of(q: Quaternion) -> float:
    w, x, y, z = q
    return atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def roll_pitch_yaw(q: Quaternion) -> Vector:
    """Turned by yaw first, then pitch, then roll."""
    w, x, y, z = q
    return (atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), asin(max(-1.0, min(1.0, 2 * (w * y - z * x)))),
            yaw_of(q))


def down_axis(q: Quaternion) -> Vector:
    """Return the body's z axis in the world frame."""
    w, x, y, z = q
    return 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)


def to_world(q: Quaternion, v: Vector) -> Vector:
    """Return the body vector `v` in the world frame."""
    w, x, y, z = q
    a, b, c = v
    tx, ty, tz = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    return a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx


def tilted(down: Vector, yaw: float) -> Quaternion:
    """Return the attitude with the body's z axis along the unit vector `down`, which must not point up.

    It is a rotation by `yaw`, followed by the smallest tilt."""
    dx, dy, dz = down
    w = sqrt(max(0.0, (1 + dz) / 2))
    x, y = -dy / (2 * w), dx / (2 * w)
    c, s = cos(yaw / 2), sin(yaw / 2)
    return w * c, x * c + y * s, y * c - x * s, w * s


def wrapped(angle: float) -> float:
    """Return the same angle within [-pi, pi]."""
    return remainder(angle, 2 * pi)
