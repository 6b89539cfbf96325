"""The flight controller's parameters, as the ground reads and sets them; the table is the only list of them.

A change outside its bounds is refused; after an accepted one `on_change` is called, upon which users read the values.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isfinite
from types import MappingProxyType
from typing import Final

from firmware_sim.autopilot.vehicle import ParameterInfo as P

TABLE: Final[Mapping[str, P]] = MappingProxyType({
    "ATT_KP": P(250.0, 10.0, 1000.0, "1/s2", "attitude error to angular acceleration, roll and pitch"),
    "ATT_KD": P(30.0, 2.0, 100.0, "1/s", "rate error to angular acceleration, roll and pitch"),
    "YAW_KP": P(6.0, 0.0, 50.0, "1/s2", "heading error to angular acceleration"),
    "YAW_KD": P(5.0, 0.1, 30.0, "1/s", "yaw rate error to angular acceleration"),
    "YAW_RATE_MAX": P(1.5, 0.1, 4.0, "rad/s", "ramp of the heading"),
    "TILT_MAX": P(0.5, 0.05, 0.8, "rad", "largest tilt of position control"),
    "ATT_TILT_MAX": P(0.8, 0.05, 1.2, "rad", "tilt to which attitude targets are clipped"),
    "RATE_MAX": P(4.0, 0.1, 10.0, "rad/s", "body rate to which rate targets are clipped"),
    "POS_KP": P(3.5, 0.0, 20.0, "1/s2", "position error to acceleration, horizontal"),
    "POS_KD": P(3.4, 0.0, 20.0, "1/s", "velocity error to acceleration, horizontal"),
    "POS_KI": P(1.2, 0.0, 10.0, "1/s3", "integral of the position error, horizontal"),
    "ALT_KP": P(9.0, 0.0, 30.0, "1/s2", "height error to acceleration"),
    "ALT_KD": P(6.0, 0.0, 30.0, "1/s", "climb rate error to acceleration"),
    "ALT_KI": P(5.0, 0.0, 20.0, "1/s3", "integral of the height error"),
    "VEL_MAX": P(1.5, 0.1, 10.0, "m/s", "ramp: horizontal speed"),
    "ACC_MAX": P(1.5, 0.1, 8.0, "m/s2", "ramp: horizontal acceleration"),
    "CLIMB_MAX": P(1.0, 0.1, 5.0, "m/s", "ramp: vertical speed"),
    "ACC_Z_MAX": P(1.5, 0.1, 5.0, "m/s2", "ramp: vertical acceleration"),
    "LAND_SPEED": P(0.3, 0.05, 1.0, "m/s", "descent rate of a landing"),
    "MIS_TAKEOFF_ALT": P(1.0, 0.3, 20.0, "m", "height of a take-off command without one"),
    "RTL_RETURN_ALT": P(1.0, 0.3, 20.0, "m", "least height of the flight home"),
    "NAV_ACC_RAD": P(0.15, 0.02, 5.0, "m", "distance at which a waypoint is reached"),
    "FENCE_XY": P(10.0, 0.5, 1000.0, "m", "distance from the origin, per axis, to which targets are clipped"),
    "FENCE_ALT": P(5.0, 0.5, 100.0, "m", "height to which targets are clipped"),
    "EST_BW": P(10.0, 0.5, 60.0, "1/s", "bandwidth of the position estimate"),
    "MOCAP_DELAY": P(0.01, 0.0, 0.5, "s", "time from an exposure to the frame's arrival"),
    "MOCAP_LOSS": P(0.3, 0.02, 5.0, "s", "time without frames after which motion capture is lost"),
    "LINK_LOSS": P(2.0, 0.1, 60.0, "s", "time without frames after which the link is lost"),
    "LINK_LOSS_ACT": P(1.0, 0.0, 3.0, "1", "0 nothing, 1 hold then land, 2 land, 3 return"),
    "LINK_HOLD": P(5.0, 0.0, 600.0, "s", "time to hold before landing"),
    "OFFB_LOSS": P(0.5, 0.05, 10.0, "s", "time without targets after which they are lost"),
    "DISARM_IDLE": P(10.0, 0.0, 600.0, "s", "time armed on the ground after which to disarm; 0: never"),
})


class ParameterTable:
    """Implements `Parameters`."""

    def __init__(self, values: Mapping[str, float], on_change: Callable[[], None]) -> None:
        """Set `values` over the defaults; raises ValueError, a line for each, if `set` would refuse any."""
        self._values = {name: info.default for name, info in TABLE.items()}
        self._on_change: Callable[[], None] = lambda: None
        if problems := [problem for name, value in values.items() if (problem := self.set(name, value))]:
            raise ValueError("\n".join(problems))
        self._on_change = on_change

    @property
    def infos(self) -> Mapping[str, P]:
        return TABLE

    def get(self, name: str) -> float:
        return self._values[name]

    def set(self, name: str, value: float) -> str:
        """Set a parameter; return "", or why it was refused (`Parameters.set`)."""
        info = TABLE.get(name)
        if info is None:
            return f"{name}: no such parameter"
        if not (isfinite(value) and info.minimum <= value <= info.maximum):
            return f"{name}={value:g}: expected {info.minimum:g} to {info.maximum:g} {info.unit}"
        self._values[name] = float(value)
        self._on_change()
        return ""
