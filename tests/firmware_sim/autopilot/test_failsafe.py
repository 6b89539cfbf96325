"""What falls silent, and a landing that is felt."""

from __future__ import annotations

import pytest

from firmware_sim.autopilot.airframe import Airframe
from firmware_sim.autopilot.failsafe import (
    LINK_HOLD,
    LINK_LAND,
    LINK_RETURN,
    MOCAP_LOST,
    TARGETS_HOLD,
    TARGETS_LAND,
    Failsafe,
    Silences,
)
from firmware_sim.autopilot.flight_controller import FlightController
from firmware_sim.autopilot.landing_detector import LandingDetector
from firmware_sim.autopilot.mission_run import MissionRun, complaint
from firmware_sim.autopilot.parameters import ParameterTable
from firmware_sim.autopilot.vehicle import ItemKind, MissionItem, Mode

S = 1_000_000_000
HEARD = Silences(0, 0, position_valid=True, position_needed=True)


def failsafe(**parameters: float) -> Failsafe:
    return Failsafe(ParameterTable(parameters, lambda: None))


def silent_link(seconds: float, position_valid: bool = True) -> Silences:
    return Silences(round(seconds * S), 0, position_valid, position_needed=False)


@pytest.mark.parametrize("mode", list(Mode))
def test_while_all_is_heard_nothing_happens(mode: Mode) -> None:
    assert failsafe().look(S, mode, HEARD) is None


@pytest.mark.parametrize(("action", "modes", "words"), [
    (0, [None, None], ["", ""]),
    (1, [Mode.HOLD, Mode.LAND], [LINK_HOLD, LINK_LAND]),
    (2, [Mode.LAND, None], [LINK_LAND, LINK_LAND]),
    (3, [Mode.RETURN, None], [LINK_RETURN, LINK_RETURN]),
])
def test_a_silent_link_does_what_its_parameter_says(action: int, modes: list, words: list[str]) -> None:
    safe, mode = failsafe(LINK_LOSS_ACT=action, LINK_LOSS=2.0, LINK_HOLD=5.0), Mode.MISSION

    assert safe.look(0, mode, silent_link(2.0)) is None
    for now_s, expected, word in zip((0.1, 5.2), modes, words, strict=True):
        new = safe.look(round(now_s * S), mode, silent_link(2.0 + now_s))
        assert (new, safe.acting) == (expected, word)
        mode = new or mode


@pytest.mark.parametrize(("parameters", "loss_s", "hold_s"), [
    ({}, 2.0, 5.0), ({"LINK_LOSS": 0.1, "LINK_HOLD": 0.0}, 0.1, 0.0), ({"LINK_LOSS": 7.5, "LINK_HOLD": 0.2}, 7.5, 0.2)])
def test_a_hold_lasts_from_the_loss_for_its_time_to_the_nanosecond(
        parameters: dict[str, float], loss_s: float, hold_s: float) -> None:
    safe, loss_ns, hold_ns = failsafe(**parameters), round(loss_s * S), round(hold_s * S)

    def look(after_ns: int, mode: Mode) -> Mode | None:         # `after_ns` the last word of the link
        return safe.look(after_ns, mode, Silences(after_ns, 0, position_valid=True, position_needed=False))

    assert (look(loss_ns, Mode.MISSION), safe.acting) == (None, "")
    assert (look(loss_ns + 1, Mode.MISSION), safe.acting) == (Mode.HOLD, LINK_HOLD)
    if hold_ns:
        assert (look(loss_ns + hold_ns, Mode.HOLD), safe.acting) == (None, LINK_HOLD)
    assert (look(loss_ns + 1 + hold_ns, Mode.HOLD), safe.acting) == (Mode.LAND, LINK_LAND)


def test_a_link_that_comes_back_ends_the_hold_and_the_next_loss_holds_for_its_whole_time() -> None:
    safe, lost = failsafe(), silent_link(2.1)
    assert safe.look(0, Mode.MISSION, lost) is Mode.HOLD

    assert safe.look(4 * S, Mode.HOLD, silent_link(0.0)) is None
    assert safe.acting == ""
    assert safe.look(9 * S, Mode.MISSION, lost) is Mode.HOLD
    assert safe.look(14 * S - 1, Mode.HOLD, lost) is None
    assert safe.look(14 * S, Mode.HOLD, lost) is Mode.LAND


def test_targets_are_lost_after_half_a_second_unless_told_otherwise() -> None:
    at, beyond = Silences(0, S // 2, True, position_needed=False), Silences(0, S // 2 + 1, True, position_needed=False)

    assert failsafe().look(0, Mode.OFFBOARD, at) is None
    assert failsafe().look(0, Mode.OFFBOARD, beyond) is Mode.HOLD


@pytest.mark.parametrize(("age_ns", "valid"), [(300_000_000, True), (300_000_001, False)])
def test_motion_capture_is_lost_after_three_tenths_of_a_second_unless_told_otherwise(age_ns: int, valid: bool) -> None:
    controller = FlightController(Airframe(), 1_000_000, 10)
    controller.captured(S, (0.0, 0.0, -2.0), S)

    controller.tick(S + age_ns, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -9.81))

    assert controller.position_valid is valid


def test_a_return_or_landing_goes_on_while_the_link_is_silent() -> None:
    for mode in (Mode.LAND, Mode.RETURN):
        safe = failsafe(LINK_LOSS_ACT=3)

        assert safe.look(0, mode, silent_link(9.0)) is None
        assert safe.acting == ""


def test_without_a_position_a_silent_link_is_a_landing() -> None:
    assert failsafe().look(0, Mode.STABILIZE, silent_link(9.0, position_valid=False)) is Mode.LAND


def test_motion_capture_counts_only_where_it_is_needed_and_once() -> None:
    safe = failsafe()
    assert safe.look(0, Mode.STABILIZE, Silences(0, 0, position_valid=False, position_needed=False)) is None

    assert safe.look(0, Mode.HOLD, Silences(0, 0, position_valid=False, position_needed=True)) is Mode.LAND
    assert safe.acting == MOCAP_LOST
    assert safe.look(1, Mode.LAND, Silences(0, 0, position_valid=False, position_needed=True)) is None


@pytest.mark.parametrize(("mode", "valid", "new", "word"), [
    (Mode.OFFBOARD, True, Mode.HOLD, TARGETS_HOLD), (Mode.OFFBOARD, False, Mode.LAND, TARGETS_LAND),
    (Mode.STABILIZE, False, Mode.LAND, TARGETS_LAND), (Mode.HOLD, True, None, ""),
])
def test_silent_targets_count_in_the_modes_that_need_them(mode: Mode, valid: bool, new: Mode | None, word: str) -> None:
    safe = failsafe(OFFB_LOSS=0.5)

    assert safe.look(0, mode, Silences(0, S // 2, valid, position_needed=False)) is None
    assert safe.look(0, mode, Silences(0, S // 2 + 1, valid, position_needed=False)) is new
    assert safe.acting == word


@pytest.mark.parametrize(("thrust", "force", "rates", "stands"), [
    (3.0, (0.0, 0.0, -9.81), (0.0, 0.0, 0.0), True),
    (4.9, (0.0, 0.0, -9.81), (0.0, 0.0, 0.0), False),           # hovers
    (3.0, (0.0, 0.0, -6.0), (0.0, 0.0, 0.0), False),            # falls
    (3.0, (0.0, 0.0, -9.81), (0.5, 0.0, 0.0), False),           # turns
])
def test_it_stands_when_something_else_than_its_rotors_carries_it(
        thrust: float, force: tuple, rates: tuple, stands: bool) -> None:
    detector = LandingDetector()

    said = [detector.stands(k * 10_000_000, thrust, 4.905, force, rates) for k in range(40)]

    assert said == [stands and k >= 30 for k in range(40)]


def test_one_sign_of_flight_starts_the_count_anew() -> None:
    detector, carried = LandingDetector(), (0.0, 0.0, -9.81)
    for k in range(29):
        assert not detector.stands(k * 10_000_000, 3.0, 4.905, carried, (0.0, 0.0, 0.0))

    assert not detector.stands(290_000_000, 4.9, 4.905, carried, (0.0, 0.0, 0.0))
    assert not detector.stands(300_000_000, 3.0, 4.905, carried, (0.0, 0.0, 0.0))


# --- missions

PARAMETERS = ParameterTable({}, lambda: None)


@pytest.mark.parametrize(("item", "why"), [
    (MissionItem(ItemKind.WAYPOINT, (11.0, 0.0, -1.0)), "item 1: outside the fence"),
    (MissionItem(ItemKind.WAYPOINT, (0.0, 0.0, 1.0)), "item 1: outside the fence"),
    (MissionItem(ItemKind.WAYPOINT, (float("nan"), 0.0, -1.0)), "item 1: not a finite number"),
    (MissionItem(ItemKind.WAYPOINT, (0.0, 0.0, -1.0), hold_s=-1.0), "item 1: negative hold or radius"),
    (MissionItem(ItemKind.WAYPOINT, (0.0, 0.0, -1.0), yaw_rad=float("inf")), "item 1: not a finite number"),
])
def test_items_that_cannot_be_flown_are_named(item: MissionItem, why: str) -> None:
    assert complaint([MissionItem(ItemKind.TAKEOFF, (0.0, 0.0, -1.0)), item], PARAMETERS) == why


def test_a_mission_that_is_too_long_is_refused() -> None:
    assert complaint([MissionItem(ItemKind.WAYPOINT, (0.0, 0.0, -1.0))] * 201, PARAMETERS) == "201 items: at most 200"


def test_an_item_is_left_after_its_hold_though_the_wind_pushes_meanwhile() -> None:
    run = MissionRun((MissionItem(ItemKind.WAYPOINT, (1.0, 0.0, -1.0), hold_s=2.0),
                      MissionItem(ItemKind.WAYPOINT, (2.0, 0.0, -1.0))))
    run.start(0, (0.0, 0.0, -1.0))

    said = [run.advance(now_s * S, (north, 0.0, -1.0), 0.15)
            for now_s, north in ((0, 0.5), (1, 0.9), (2, 0.7), (3, 1.0), (4, 1.0))]

    assert said == [False, False, False, True, False]
    assert run.index == 1


def test_a_landing_item_goes_there_first_and_then_down() -> None:
    run = MissionRun((MissionItem(ItemKind.LAND, (2.0, 1.0, 0.0)),))
    run.start(0, (0.0, 0.0, -1.5))
    assert run.goal(0.3).velocity_ned_mps == (None, None, None)

    assert not run.advance(0, (2.0, 1.05, -1.5), 0.15)

    assert (run.goal(0.3).position_ned_m, run.goal(0.3).velocity_ned_mps) == ((2.0, 1.0, None), (None, None, 0.3))
    run.landed((2.0, 1.0, 0.0))
    assert run.item is None
