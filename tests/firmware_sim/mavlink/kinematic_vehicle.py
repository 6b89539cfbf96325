"""A stand-in for the flight controller: a point that goes where it is told at a fixed speed. It has no physics.

It obeys the contract of `firmware_sim/autopilot/vehicle.py` as far as the MAVLink front's tests need it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, dist, isfinite, sin

from firmware_sim.autopilot.vehicle import (
    AttitudeTarget,
    ItemKind,
    Landed,
    MissionItem,
    Mode,
    ParameterInfo,
    PositionTarget,
    Result,
    Severity,
    Target,
    VehicleState,
)

SPEED_MPS = 2.0
REACHED_M = 0.05
FENCE_M = 50.0


@dataclass
class KinematicParameters:
    def __post_init__(self):
        self.infos = {"MIS_TAKEOFF_ALT": ParameterInfo(1.5, 0.5, 10.0, "m", "height of a take-off"),
                      "NAV_ACC_RAD": ParameterInfo(0.3, 0.05, 5.0, "m", "a waypoint is reached within"),
                      "MPC_XY_VEL_MAX": ParameterInfo(2.0, 0.1, 5.0, "m/s", "fastest")}
        self.values = {name: info.default for name, info in self.infos.items()}

    def get(self, name):
        return self.values[name]

    def set(self, name, value):
        info = self.infos[name]
        if not info.minimum <= value <= info.maximum:
            return f"{name}={value:g}: expected {info.minimum:g} to {info.maximum:g}"
        self.values[name] = value
        return ""


class KinematicVehicle:
    def __init__(self):
        self.parameters = KinematicParameters()
        self.on_notice = lambda severity, text: None
        self.mission: Sequence[MissionItem] = ()
        self.position, self.velocity, self.yaw = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0
        self.armed, self.mode, self.failsafe = False, Mode.HOLD, ""
        self.position_valid = True
        self.goal = self.position
        self.index = -1
        self.targets: list[Target] = []
        self.heard_ns: list[int] = []
        self.now_ns = 0
        self.calls: list[str] = []

    # --- time passes

    def advance(self, now_ns):
        dt = (now_ns - self.now_ns) * 1e-9
        self.now_ns = now_ns
        away = dist(self.position, self.goal)
        step = min(away, SPEED_MPS * dt)
        if away > 0 and self.armed:
            moved = tuple(p + (g - p) * step / away for p, g in zip(self.position, self.goal, strict=True))
            self.velocity = tuple((m - p) / dt if dt else 0.0 for m, p in zip(moved, self.position, strict=True))
            self.position = moved
        else:
            self.velocity = (0.0, 0.0, 0.0)
        there = dist(self.position, self.goal) < REACHED_M
        if self.mode is Mode.TAKEOFF and there:
            self.mode = Mode.HOLD
        if self.mode is Mode.LAND and there:
            self.armed, self.mode = False, Mode.HOLD
        if self.mode is Mode.MISSION and there:
            self._next_item()

    def _next_item(self):
        self.index += 1
        if self.index >= len(self.mission):
            self.mode = Mode.HOLD
            return
        item = self.mission[self.index]
        if item.kind is ItemKind.TAKEOFF:
            self.goal = (*self.position[:2], item.position_ned_m[2])
        elif item.kind is ItemKind.LAND:
            self.goal = (*item.position_ned_m[:2], 0.0)
        elif item.kind is ItemKind.RETURN:
            self.goal = (0.0, 0.0, 0.0)
        else:
            self.goal = item.position_ned_m

    # --- the contract

    def state(self):
        height = -self.position[2]
        landed = (Landed.ON_GROUND if height < REACHED_M and not (self.mode is Mode.TAKEOFF and self.armed) else
                  Landed.TAKING_OFF if self.mode is Mode.TAKEOFF else
                  Landed.LANDING if self.mode is Mode.LAND else Landed.IN_AIR)
        return VehicleState(self.now_ns, self.position, self.velocity, (cos(self.yaw / 2), 0.0, 0.0, sin(self.yaw / 2)),
                            (0.0, 0.0, 0.0), self.armed, self.mode, landed, self.failsafe, self.index,
                            self.position_valid)

    def arm(self, force=False):
        self.calls.append(f"arm {force}")
        if not self.position_valid and not force:
            self.on_notice(Severity.ERROR, "arming refused: no position")
            return Result.TEMPORARILY_REJECTED
        self.armed = True
        return Result.ACCEPTED

    def disarm(self, force=False):
        self.calls.append(f"disarm {force}")
        if self.state().landed is not Landed.ON_GROUND and not force:
            return Result.TEMPORARILY_REJECTED
        self.armed = False
        return Result.ACCEPTED

    def set_mode(self, mode):
        self.calls.append(f"mode {mode.value}")
        if mode is Mode.TAKEOFF:
            return self.take_off(self.parameters.get("MIS_TAKEOFF_ALT"))
        if mode is Mode.LAND:
            return self.land()
        if mode is Mode.MISSION:
            return self.start_mission(max(self.index, 0))
        if mode is Mode.OFFBOARD and not self.targets:
            return Result.TEMPORARILY_REJECTED
        self.mode = mode
        if mode is Mode.HOLD:
            self.goal = self.position
        elif mode is Mode.RETURN:
            self.goal = (0.0, 0.0, self.position[2])
        return Result.ACCEPTED

    def take_off(self, height_m):
        self.calls.append(f"take off {height_m:g}")
        if not isfinite(height_m) or not 0 < height_m <= FENCE_M:
            return Result.DENIED
        if not self.armed:
            return Result.TEMPORARILY_REJECTED
        self.mode, self.goal = Mode.TAKEOFF, (*self.position[:2], -height_m)
        return Result.ACCEPTED

    def land(self):
        self.calls.append("land")
        self.mode, self.goal = Mode.LAND, (*self.position[:2], 0.0)
        return Result.ACCEPTED

    def target(self, target, now_ns):
        self.targets.append(target)
        if self.mode is not Mode.OFFBOARD or isinstance(target, AttitudeTarget):
            return []
        return self._follow(target)

    def _follow(self, target: PositionTarget):
        wanted = [here + (v or 0.0) if p is None else p for here, p, v in
                  zip(self.position, target.position_ned_m, target.velocity_ned_mps, strict=True)]
        clipped = [max(-FENCE_M, min(FENCE_M, value)) for value in wanted]
        self.goal = tuple(clipped)
        if target.yaw_rad is not None:
            self.yaw = target.yaw_rad
        return [] if clipped == wanted else ["position clipped"]

    def load_mission(self, items):
        self.calls.append(f"load {len(items)}")
        if self.mode is Mode.MISSION:
            return Result.TEMPORARILY_REJECTED
        self.mission, self.index = tuple(items), -1
        return Result.ACCEPTED

    def start_mission(self, first=0):
        self.calls.append(f"mission {first}")
        if first >= len(self.mission):
            return Result.DENIED
        if not self.armed:
            return Result.TEMPORARILY_REJECTED
        self.mode, self.index = Mode.MISSION, first - 1
        self._next_item()
        return Result.ACCEPTED

    def link_heard(self, now_ns):
        self.heard_ns.append(now_ns)
