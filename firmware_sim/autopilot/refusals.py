"""Reasons why arming or a mode is refused now, as text for the operator; "" if it is allowed.

`modes.MODES` has the rules of each mode. Arming also needs a level stand and, unless LINK_LOSS_ACT is 0, a link;
`force` skips these two.
"""

from __future__ import annotations

from dataclasses import dataclass

from firmware_sim.autopilot.modes import MODES, Targets, Where, needs_position
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


def arming(mode: Mode, facts: Facts, force: bool) -> str:
    rules = MODES[mode]
    if needs_position(mode, facts.attitude_told) and not facts.position_valid:
        return "no motion capture"
    if not rules.arms:
        return f"mode {mode.value}"
    if rules.targets is Targets.ANY and not facts.targets_fresh:
        return "no stream of targets"
    if not force and facts.tilt_rad > ARMING_TILT:
        return "not level"
    return "" if force or facts.link_ready else "no link"


def entering(mode: Mode, facts: Facts) -> str:
    rules = MODES[mode]
    if rules.begins and not facts.armed:
        return "not armed"
    if rules.begins is Where.ON_GROUND and not facts.on_ground:
        return "in the air already"
    if rules.begins is Where.IN_AIR and facts.on_ground:
        return "not in the air"
    if rules.targets is Targets.ANY and not facts.targets_fresh:
        return "no stream of targets"
    attitudes = facts.targets_fresh and facts.attitude_told
    if rules.targets is Targets.ATTITUDES_IN_AIR and not facts.on_ground and not attitudes:
        return "no stream of attitudes"
    if not rules.blind and needs_position(mode, facts.attitude_told) and not facts.position_valid:
        return "no motion capture"
    return ""
