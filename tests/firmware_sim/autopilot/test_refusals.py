"""Rules of arming and of modes, one broken at a time."""

from __future__ import annotations

from dataclasses import replace

import pytest

from firmware_sim.autopilot.modes import AFTER, MODES
from firmware_sim.autopilot.refusals import Facts, arming, entering
from firmware_sim.autopilot.vehicle import Mode

GROUND = Facts(armed=False, on_ground=True, position_valid=True, targets_fresh=True, attitude_told=False,
               link_ready=True, tilt_rad=0.0)
AIR = replace(GROUND, armed=True, on_ground=False)


@pytest.mark.parametrize("mode", [Mode.STABILIZE, Mode.HOLD, Mode.OFFBOARD, Mode.MISSION])
def test_with_everything_there_it_may_be_armed(mode: Mode) -> None:
    assert arming(mode, GROUND, force=False) == ""


@pytest.mark.parametrize(("mode", "facts", "why", "forced"), [
    (Mode.HOLD, {"position_valid": False}, "no motion capture", False),
    (Mode.STABILIZE, {"position_valid": False}, "", True),
    (Mode.OFFBOARD, {"position_valid": False}, "no motion capture", False),
    (Mode.OFFBOARD, {"position_valid": False, "attitude_told": True}, "", True),
    (Mode.OFFBOARD, {"targets_fresh": False}, "no stream of targets", False),
    (Mode.HOLD, {"targets_fresh": False}, "", True),
    (Mode.HOLD, {"link_ready": False}, "no link", True),
    (Mode.HOLD, {"tilt_rad": 0.31}, "not level", True),
    (Mode.LAND, {}, "mode land", False),
    (Mode.RETURN, {}, "mode return", False),
    (Mode.TAKEOFF, {}, "mode takeoff", False),
])
def test_arming_is_refused_for_its_reason_and_force_passes_over_link_and_tilt(
        mode: Mode, facts: dict, why: str, forced: bool) -> None:
    assert arming(mode, replace(GROUND, **facts), force=False) == why
    assert (arming(mode, replace(GROUND, **facts), force=True) == "") == forced


@pytest.mark.parametrize(("mode", "where", "facts", "why"), [
    (Mode.TAKEOFF, GROUND, {"armed": True}, ""),
    (Mode.TAKEOFF, GROUND, {}, "not armed"),
    (Mode.TAKEOFF, AIR, {}, "in the air already"),
    (Mode.TAKEOFF, GROUND, {"armed": True, "position_valid": False}, "no motion capture"),
    (Mode.LAND, AIR, {}, ""),
    (Mode.LAND, AIR, {"position_valid": False}, ""),
    (Mode.LAND, GROUND, {"armed": True}, "not in the air"),
    (Mode.LAND, GROUND, {}, "not armed"),
    (Mode.RETURN, AIR, {}, ""),
    (Mode.RETURN, AIR, {"position_valid": False}, "no motion capture"),
    (Mode.RETURN, GROUND, {"armed": True}, "not in the air"),
    (Mode.HOLD, AIR, {"position_valid": False}, "no motion capture"),
    (Mode.HOLD, GROUND, {"targets_fresh": False}, ""),
    (Mode.MISSION, AIR, {"position_valid": False}, "no motion capture"),
    (Mode.OFFBOARD, AIR, {"targets_fresh": False}, "no stream of targets"),
    (Mode.OFFBOARD, AIR, {"position_valid": False}, "no motion capture"),
    (Mode.OFFBOARD, AIR, {"position_valid": False, "attitude_told": True}, ""),
    (Mode.STABILIZE, AIR, {"attitude_told": True, "position_valid": False}, ""),
    (Mode.STABILIZE, AIR, {}, "no stream of attitudes"),
    (Mode.STABILIZE, AIR, {"attitude_told": True, "targets_fresh": False}, "no stream of attitudes"),
    (Mode.STABILIZE, GROUND, {"targets_fresh": False}, ""),
])
def test_a_mode_is_entered_or_refused_for_its_reason(mode: Mode, where: Facts, facts: dict, why: str) -> None:
    assert entering(mode, replace(where, **facts)) == why


def test_every_mode_has_its_rules_and_each_transition_leads_on() -> None:
    assert MODES.keys() == set(Mode)
    assert all(MODES[mode].disarmed if to is None else to is not mode for (mode, _), (to, _) in AFTER.items())
