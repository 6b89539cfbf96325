"""Reasons why arming or a mode is refused now, as text for the operator; "" if it is allowed.

| | armed | in the air | motion capture | fresh targets |
|---|---|---|---|---|
| arm | | | unless STABILIZE or attitudes in OFFBOARD | in OFFBOARD |
| HOLD, MISSION | | | needed | |
| OFFBOARD | | | for positions | needed |
| STABILIZE | | | | attitudes, in the air |
| TAKEOFF | needed | must not be | needed | |
| LAND | needed | needed | | |
| RETURN | needed | needed | needed | |

Arming also needs a level stand and, unless LINK_LOSS_ACT is 0, a link; `force` skips these two.
"""

from __future__ import annotations

from dataclasses import dataclass

from firmware_sim.autopilot.vehicle import Mode

ARMING_TILT = 0.3           # [rad]


@dataclass(frozen=True, slots=True)
class Facts:
    armed: bool
    on_ground: bool
    position_valid: bool
    targets_fresh: bool
    attitude_told: bool         # the last target was an attitude or rates
    link_ready: bool            # the link is heard, or LINK_LOSS_ACT is 0
    tilt_rad: float


def needs_position(mode: Mode, attitude_told: bool) -> bool:
    if mode is Mode.OFFBOARD:
        return not attitude_told
    return mode is not Mode.STABILIZE


def arming(mode: Mode, facts: Facts, force: bool) -> str:
    if needs_position(mode, facts.attitude_told) and not facts.position_valid:
        return "no motion capture"
    if mode in (Mode.LAND, Mode.RETURN, Mode.TAKEOFF):
        return f"mode {mode.value}"
    if mode is Mode.OFFBOARD and not facts.targets_fresh:
        return "no stream of targets"
    if not force and facts.tilt_rad > ARMING_TILT:
        return "not level"
    return "" if force or facts.link_ready else "no link"


def entering(mode: Mode, facts: Facts) -> str:
    if mode in (Mode.TAKEOFF, Mode.LAND, Mode.RETURN) and not facts.armed:
        return "not armed"
    if mode is Mode.TAKEOFF and not facts.on_ground:
        return "in the air already"
    if mode in (Mode.LAND, Mode.RETURN) and facts.on_ground:
        return "not in the air"
    if mode is Mode.OFFBOARD and not facts.targets_fresh:
        return "no stream of targets"
    if mode is Mode.STABILIZE and not facts.on_ground and not (facts.targets_fresh and facts.attitude_told):
        return "no stream of attitudes"
    if mode is not Mode.LAND and needs_position(mode, facts.attitude_told) and not facts.position_valid:
        return "no motion capture"
    return ""
