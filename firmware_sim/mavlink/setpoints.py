"""Converts SET_POSITION_TARGET_LOCAL_NED and SET_ATTITUDE_TARGET to targets of the vehicle, or to a refusal's reason.

    type mask bit set: that field is ignored. Position, velocity and yaw axis by axis; accelerations are refused.
    frames: LOCAL_NED; LOCAL_OFFSET_NED: relative to the position; BODY_NED: offset and velocity turned by the heading
"""

from __future__ import annotations

from math import cos, hypot, isfinite, sin

from firmware_sim.autopilot.frames import yaw_of
from firmware_sim.autopilot.vehicle import AttitudeTarget, PerAxis, PositionTarget, VehicleState
from firmware_sim.mavlink.dialect import Message
from firmware_sim.mavlink.enums import AttitudeIgnore, Frame, PositionIgnore

AXES = (PositionIgnore.X_IGNORE, PositionIgnore.Y_IGNORE, PositionIgnore.Z_IGNORE)
SPEEDS = (PositionIgnore.VX_IGNORE, PositionIgnore.VY_IGNORE, PositionIgnore.VZ_IGNORE)
ACCELERATIONS = PositionIgnore.AX_IGNORE | PositionIgnore.AY_IGNORE | PositionIgnore.AZ_IGNORE
RATES = (AttitudeIgnore.BODY_ROLL_RATE_IGNORE | AttitudeIgnore.BODY_PITCH_RATE_IGNORE
         | AttitudeIgnore.BODY_YAW_RATE_IGNORE)


def position_target(message: Message, state: VehicleState) -> PositionTarget | str:
    mask = PositionIgnore(message["type_mask"] & 0xFFF)
    frame = message["coordinate_frame"]
    if mask & PositionIgnore.FORCE_SET or ACCELERATIONS & ~mask:
        return "target refused: no acceleration or force"
    position = _axes(message, ("x", "y", "z"), mask, AXES)
    velocity = _axes(message, ("vx", "vy", "vz"), mask, SPEEDS)
    yaw = None if mask & PositionIgnore.YAW_IGNORE else message["yaw"]
    yaw_rate = None if mask & PositionIgnore.YAW_RATE_IGNORE else message["yaw_rate"]
    if not all(isfinite(value) for value in (*position, *velocity, yaw, yaw_rate) if value is not None):
        return "target refused: numbers that are not finite"
    if position == velocity == (None, None, None) and yaw is None and yaw_rate is None:
        return "target refused: everything is ignored"
    if frame == Frame.BODY_NED:
        if any(_half(axes) for axes in (position, velocity)):
            return "target refused: BODY_NED needs x and y"
        heading_rad = yaw_of(state.quaternion_wxyz)
        position, velocity = _turned(position, heading_rad), _turned(velocity, heading_rad)
        yaw = None if yaw is None else yaw + heading_rad
    elif frame not in (Frame.LOCAL_NED, Frame.LOCAL_OFFSET_NED):
        return f"target refused: frame {frame}"
    if frame != Frame.LOCAL_NED:
        x, y, z = (None if value is None else value + here
                   for value, here in zip(position, state.position_ned_m, strict=True))
        position = x, y, z
    return PositionTarget(position, velocity, yaw, yaw_rate)


def attitude_target(message: Message) -> AttitudeTarget | str:
    mask = AttitudeIgnore(message["type_mask"] & 0xC7)
    w, x, y, z = message["q"]
    rates = message["body_roll_rate"], message["body_pitch_rate"], message["body_yaw_rate"]
    if mask & AttitudeIgnore.THROTTLE_IGNORE:
        return "target refused: no thrust"
    if not isfinite(message["thrust"]):
        return "target refused: numbers that are not finite"
    if not mask & AttitudeIgnore.ATTITUDE_IGNORE:
        norm = hypot(w, x, y, z)
        if not (isfinite(norm) and norm > 0.5):
            return "target refused: not an attitude"
        forward = None if mask & RATES or not all(map(isfinite, rates)) else rates
        return AttitudeTarget((w / norm, x / norm, y / norm, z / norm), forward, message["thrust"])
    if mask & RATES:
        return "target refused: neither attitude nor all rates"
    if not all(map(isfinite, rates)):
        return "target refused: numbers that are not finite"
    return AttitudeTarget(None, rates, message["thrust"])


def _axes(message: Message, names: tuple[str, str, str], mask: PositionIgnore,
          ignored: tuple[PositionIgnore, PositionIgnore, PositionIgnore]) -> PerAxis:
    x, y, z = (None if mask & bit else message[name] for name, bit in zip(names, ignored, strict=True))
    return x, y, z


def _half(axes: PerAxis) -> bool:
    return (axes[0] is None) != (axes[1] is None)


def _turned(axes: PerAxis, by_rad: float) -> PerAxis:
    x, y, z = axes
    if x is None or y is None:
        return axes
    return x * cos(by_rad) - y * sin(by_rad), x * sin(by_rad) + y * cos(by_rad), z
