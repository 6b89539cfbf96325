"""Limits targets from a link: clips numbers beyond limits, refuses invalid targets, and names each change.

A number that is not finite makes the whole target invalid.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import acos, cos, hypot, isfinite, sin

from firmware_sim.autopilot.frames import down_axis, tilted, wrapped, yaw_of
from firmware_sim.autopilot.vehicle import AttitudeTarget, Parameters, PerAxis, PositionTarget, Target

AXES = ("north", "east", "down")


def limited(target: Target, parameters: Parameters) -> tuple[Target | None, list[str]]:
    """Return the target within limits, None if it is refused, and a text for each number clipped or refused."""
    if bad := [name for name, value in _numbers(target) if not isfinite(value)]:
        return None, [f"{name} is not finite: refused" for name in bad]
    return _position(target, parameters) if isinstance(target, PositionTarget) else _attitude(target, parameters)


def _numbers(target: Target) -> Iterable[tuple[str, float]]:
    if isinstance(target, PositionTarget):
        for i, axis in enumerate(AXES):
            yield from ((f"{kind} {axis}", value) for kind, value in
                        (("position", target.position_ned_m[i]), ("velocity", target.velocity_ned_mps[i]))
                        if value is not None)
        yield from ((name, value) for name, value in (("yaw", target.yaw_rad), ("yaw rate", target.yaw_rate_radps))
                    if value is not None)
    else:
        yield from (("attitude", value) for value in target.quaternion_wxyz or ())
        yield from (("body rate", value) for value in target.rates_radps or ())
        yield "thrust", target.thrust


def _position(target: PositionTarget, parameters: Parameters) -> tuple[Target, list[str]]:
    get, said = parameters.get, list[str]()
    fence, height = get("FENCE_XY"), get("FENCE_ALT")
    position: PerAxis = (_clip("position north", target.position_ned_m[0], -fence, fence, said),
                         _clip("position east", target.position_ned_m[1], -fence, fence, said),
                         _clip("position down", target.position_ned_m[2], -height, 0.0, said))
    north, east, down = target.velocity_ned_mps
    fast, climb = get("VEL_MAX"), get("CLIMB_MAX")
    speed = hypot(north or 0.0, east or 0.0)
    if speed > fast:
        said.append(f"horizontal speed {speed:.3g} clipped to {fast:g}")
        north, east = (None if v is None else v * fast / speed for v in (north, east))
    velocity: PerAxis = (north, east, _clip("velocity down", down, -climb, climb, said))
    most = get("YAW_RATE_MAX")
    rate = _clip("yaw rate", target.yaw_rate_radps, -most, most, said)
    return PositionTarget(position, velocity, None if target.yaw_rad is None else wrapped(target.yaw_rad), rate), said


def _attitude(target: AttitudeTarget, parameters: Parameters) -> tuple[Target | None, list[str]]:
    said = list[str]()
    thrust = _clip("thrust", target.thrust, 0.0, 1.0, said)
    assert thrust is not None
    rates, q = target.rates_radps, target.quaternion_wxyz
    if q is None and rates is None:
        return None, ["neither attitude nor body rates: refused"]
    if rates is not None:
        most = parameters.get("RATE_MAX")
        x, y, z = (_clip(f"body rate {axis}", rate, -most, most, said) or 0.0
                   for axis, rate in zip("xyz", rates, strict=True))
        rates = x, y, z
    if q is not None:
        length = hypot(*q)
        if not 0.9 < length < 1.1:
            return None, [f"attitude of length {length:.3g}, not 1: refused"]
        w, x, y, z = (each / length for each in q)
        q = w, x, y, z
        dx, dy, dz = down_axis(q)
        tilt, most = acos(max(-1.0, min(1.0, dz))), parameters.get("ATT_TILT_MAX")
        if tilt > most:
            aside = hypot(dx, dy)
            if aside == 0:
                return None, ["attitude upside down: refused"]
            said.append(f"tilt {tilt:.3g} clipped to {most:g}")
            q = tilted((dx / aside * sin(most), dy / aside * sin(most), cos(most)), yaw_of(q))
    return AttitudeTarget(q, rates, thrust), said


def _clip(name: str, value: float | None, low: float, high: float, said: list[str]) -> float | None:
    if value is None or low <= value <= high:
        return value
    clipped = min(high, max(low, value))
    said.append(f"{name} {value:.3g} clipped to {clipped:g}")
    return clipped
