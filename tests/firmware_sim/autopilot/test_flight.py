"""Closed loop: the flight controller on its board flies the real plant, seen by motion capture alone."""

from __future__ import annotations

from collections.abc import Callable
from math import dist, hypot, pi, radians

import pytest

from firmware_sim.autopilot.frames import wrapped
from firmware_sim.autopilot.vehicle import (
    AttitudeTarget,
    ItemKind,
    Landed,
    MissionItem,
    Mode,
    PositionTarget,
    Result,
)
from tests.firmware_sim.autopilot.attitude import from_roll_pitch_yaw

Bench = Callable[..., "FlightBench"]             # noqa: F821  (of conftest.py)
NOISE_M = 0.001


def worst(bench, seconds: float, of: Callable[[], float]) -> float:
    found: list[float] = []
    bench.run(seconds, lambda: found.append(of()))
    return max(found)


# --- hover


def test_it_takes_off_and_hovers_within_a_few_times_the_noise_of_motion_capture(bench: Bench) -> None:
    uav = bench().flying(1.2)

    error = worst(uav, 5.0, lambda: dist(uav.ned(), (0.0, 0.0, -1.2)))

    assert error < 5 * NOISE_M
    assert "take-off done" in uav.notices


@pytest.mark.parametrize(("plant", "within_m"), [
    ({"mass": 0.6}, 0.01), pytest.param({"mass": 0.35}, 0.01, marks=pytest.mark.slow),
    pytest.param({"tau_motor": 0.08}, 0.01, marks=pytest.mark.slow),
    pytest.param({"k_moment": 2.7e-7, "J": [3.65e-3, 3.68e-3, 7.03e-3]}, 0.01, marks=pytest.mark.slow),
    ({"wind": [2.0, -1.0, 0.0]}, 0.01),
])
def test_it_hovers_where_it_was_told_although_the_vehicle_is_not_the_one_it_knows(
        plant: dict, within_m: float, bench: Bench) -> None:
    uav = bench({key: value for key, value in plant.items() if key != "wind"})
    if "wind" in plant:
        uav.plant.input_group([f"wind[{i}]" for i in (1, 2, 3)]).write(plant["wind"])
    uav.flying(1.0).run(8.0)

    assert worst(uav, 3.0, lambda: dist(uav.ned(), (0.0, 0.0, -1.0))) < within_m


def test_a_gust_pushes_it_away_and_it_comes_back(bench: Bench) -> None:
    uav = bench().flying()
    uav.plant.input_group(["wind[1]"]).write([3.0])         # 0.45 N of drag, 0.9 m/s2
    pushed = worst(uav, 2.0, lambda: abs(uav.ned()[1]))

    uav.run(8.0)

    assert 0.05 < pushed < 0.9 / 3.5                        # less than a spring of POS_KP alone would give way
    assert abs(uav.ned()[1]) < 5 * NOISE_M


# --- waypoints


def test_a_new_waypoint_is_approached_on_a_ramp_with_its_limits(bench: Bench) -> None:
    uav = bench().flying()
    rows: list[tuple[float, float, float]] = []
    v = uav.plant.output_group(["v[1]", "v[2]", "v[3]"])
    ramp = uav.controller.loops.horizontal

    uav.fly_to(PositionTarget((3.0, 0.0, -1.0)), 8.0, lambda: rows.append(
        (uav.ned()[0], hypot(*v.read()), hypot(*ramp.acceleration))))

    # VEL_MAX, and what CATCH_UP ACC_MAX adds while the attitude is late by ATT_KD / ATT_KP = 0.12 s
    assert 1.5 < max(speed for _, speed, _ in rows) < 1.5 + 1.5 * 1.5 * 0.12 + 0.05
    assert max(accel for *_, accel in rows) <= 1.5 * 1.5 * (1 + 1e-9)                   # CATCH_UP ACC_MAX
    assert max(north for north, *_ in rows) < 3.02                                      # overshoot
    # trapezoid: 3 m at 1.5 m/s and 1.5 m/s2 takes 3 s, the linear end two time constants more
    arrival = next(k for k, (north, *_) in enumerate(rows) if north > 2.9) / 100
    assert 2.5 < arrival < 4.0
    assert uav.ned()[0] == pytest.approx(3.0, abs=0.02)


def test_height_and_heading_are_held_while_it_tracks_waypoints(bench: Bench) -> None:
    """As in Figure 3.11: roll and pitch work, height and heading stay."""
    uav = bench().flying()
    heading = uav.plant.get("heading")
    corners = [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)]
    tilts, heights, headings = [], [], []

    def watch() -> None:
        tilts.append(max(abs(uav.plant.get("roll")), abs(uav.plant.get("pitch"))))
        heights.append(abs(-uav.ned()[2] - 1.0))
        headings.append(abs(uav.plant.get("heading") - heading))

    for north, east in corners:
        uav.fly_to(PositionTarget((north, east, -1.0)), 2.0, watch)

    assert max(tilts) > radians(5)
    assert max(heights) < 0.05
    assert max(headings) < radians(3)


def test_it_turns_to_the_heading_it_is_told_the_short_way(bench: Bench) -> None:
    uav = bench().flying()                      # faces the plant's x axis, east: yaw = pi / 2
    behind: list[float] = []

    uav.fly_to(PositionTarget((0.0, 0.0, -1.0), yaw_rad=-pi + 0.1), 5.0, lambda: behind.append(
        wrapped(uav.controller.loops.yaw_ref - pi / 2 + uav.plant.get("heading"))))

    assert max(behind) < 0.4                    # of a ramp of 1.5 rad/s; 1.25 rad, were its rate not told on
    assert uav.plant.get("heading") == pytest.approx(pi / 2 - (-pi + 0.1) - 2 * pi, abs=0.02)
    assert dist(uav.ned(), (0.0, 0.0, -1.0)) < 0.03


def test_a_velocity_is_flown_and_its_end_is_a_stand(bench: Bench) -> None:
    uav = bench().flying()
    uav.fly_to(PositionTarget(velocity_ned_mps=(0.5, -0.25, 0.0)), 4.0)
    v = uav.plant.output_group(["v[1]", "v[2]", "v[3]"]).read()

    assert v == pytest.approx((-0.25, 0.5, 0.0), abs=0.03)
    uav.commanded = None
    assert uav.controller.set_mode(Mode.HOLD) is Result.ACCEPTED
    uav.run(4.0)
    place = uav.ned()
    assert worst(uav, 2.0, lambda: dist(uav.ned(), place)) < 0.03


def test_attitude_targets_fly_it_without_motion_capture(bench: Bench) -> None:
    uav = bench().flying(2.0)
    uav.captured = False
    hover = uav.controller.loops.hover_n / uav.controller.loops.airframe.full_thrust_n
    uav.commanded = AttitudeTarget(from_roll_pitch_yaw(0.1, -0.05, pi / 2), None, hover)
    uav.controller.target(uav.commanded, uav.board.now_ns)

    assert uav.controller.set_mode(Mode.STABILIZE) is Result.ACCEPTED
    uav.run(0.6)

    assert (uav.plant.get("roll"), uav.plant.get("pitch")) == pytest.approx((0.1, 0.05), abs=0.01)  # FLU: nose down
    assert uav.controller.state().failsafe == ""


# --- landing, mission, home


def test_it_lands_where_it_is_and_stops_its_motors(bench: Bench) -> None:
    uav = bench().flying()
    speeds: list[float] = []

    assert uav.controller.land() is Result.ACCEPTED
    uav.run(6.0, lambda: speeds.append(uav.plant.get("v[3]")))

    state = uav.controller.state()
    assert (state.armed, state.landed, state.mode) == (False, Landed.ON_GROUND, Mode.HOLD)
    assert uav.plant.get("on_ground") == 1.0
    assert min(speeds) > -0.45                  # LAND_SPEED 0.3, with the ramp's beginning
    assert hypot(*uav.ned()[:2]) < 0.02
    assert max(uav.plant.get(f"motor[{i}]") for i in range(1, 5)) < 1.0


def test_a_second_flight_begins_as_the_first_did(bench: Bench) -> None:
    uav = bench({"mass": 0.6}).run(0.2)
    heights = []
    for _ in range(2):
        uav.controller.arm()
        uav.controller.take_off(1.0)
        heights.append(-uav.run(0.8).ned()[2])
        uav.run(4.0)
        uav.controller.land()
        uav.run(8.0)
        assert not uav.controller.state().armed

    assert heights[1] == pytest.approx(heights[0], abs=0.03)


def test_it_lands_by_offboard_targets_and_idles_armed(bench: Bench) -> None:
    uav = bench().flying()

    uav.fly_to(PositionTarget((0.0, 0.0, 0.0)), 6.0)

    state = uav.controller.state()
    assert (state.armed, state.landed) == (True, Landed.ON_GROUND)
    assert uav.plant.get("on_ground") == 1.0
    uav.fly_to(PositionTarget((0.0, 0.0, -0.8)), 5.0)
    assert uav.ned()[2] == pytest.approx(-0.8, abs=0.05)


def test_a_mission_takes_off_visits_its_waypoints_and_lands_at_its_end(bench: Bench) -> None:
    uav = bench()
    items = [MissionItem(ItemKind.TAKEOFF, (0.0, 0.0, -1.0)),
             MissionItem(ItemKind.WAYPOINT, (1.5, 0.0, -1.0), hold_s=1.0),
             MissionItem(ItemKind.WAYPOINT, (1.5, 1.0, -1.5), acceptance_m=0.1),
             MissionItem(ItemKind.LAND, (0.5, 1.0, 0.0))]
    nearest = [10.0] * 3
    indices: list[int] = []

    def watch() -> None:
        indices.append(uav.controller.state().waypoint_index)
        for k in range(3):
            nearest[k] = min(nearest[k], dist(uav.ned(), items[k].position_ned_m))

    uav.run(0.2)
    assert uav.controller.load_mission(items) is Result.ACCEPTED
    assert uav.controller.start_mission() is Result.ACCEPTED
    assert uav.controller.arm() is Result.ACCEPTED
    uav.run(22.0, watch)

    assert list(dict.fromkeys(indices)) == [0, 1, 2, 3, 4]
    assert indices.count(1) > 100               # holds for a second
    assert max(nearest) < 0.16
    assert uav.ned() == pytest.approx((0.5, 1.0, 0.0), abs=0.05)
    assert not uav.controller.state().armed


def test_a_mission_that_ends_in_the_air_is_held_at_its_last_waypoint(bench: Bench) -> None:
    uav = bench().flying()
    uav.controller.load_mission([MissionItem(ItemKind.WAYPOINT, (1.0, -1.0, -1.4), acceptance_m=0.3)])

    assert uav.controller.start_mission() is Result.ACCEPTED
    uav.run(8.0)

    assert (uav.controller.state().mode, uav.controller.state().waypoint_index) == (Mode.HOLD, 1)
    assert uav.ned() == pytest.approx((1.0, -1.0, -1.4), abs=0.01)


def test_a_mission_may_end_with_the_way_home(bench: Bench) -> None:
    uav = bench().run(0.2)
    uav.controller.load_mission([MissionItem(ItemKind.TAKEOFF, (0.0, 0.0, -0.8)),
                                 MissionItem(ItemKind.WAYPOINT, (1.0, 0.0, -0.8)),
                                 MissionItem(ItemKind.RETURN, (0.0, 0.0, 0.0))])
    uav.controller.start_mission()
    uav.controller.arm()
    highest: list[float] = []

    uav.run(16.0, lambda: highest.append(-uav.ned()[2]))

    assert "mission: returning home" in uav.notices
    assert max(highest) == pytest.approx(1.0, abs=0.05)         # RTL_RETURN_ALT, higher than the mission
    assert uav.ned() == pytest.approx((0.0, 0.0, 0.0), abs=0.02)
    assert not uav.controller.state().armed


def test_a_take_off_stops_at_the_fence(bench: Bench) -> None:
    uav = bench(parameters={"FENCE_ALT": 1.5}).flying(99.0)

    assert uav.ned()[2] == pytest.approx(-1.5, abs=0.02)
    assert "take-off height 99 clipped to 1.5" in uav.notices


def test_return_flies_home_and_lands_there(bench: Bench) -> None:
    uav = bench({"x": 1.0, "y": 0.5}).flying()
    uav.fly_to(PositionTarget((2.0, 3.0, -0.5)), 4.0)
    uav.commanded = None

    assert uav.controller.set_mode(Mode.RETURN) is Result.ACCEPTED
    uav.run(12.0)

    assert uav.ned() == pytest.approx((0.5, 1.0, 0.0), abs=0.02)
    assert not uav.controller.state().armed


# --- failsafes


def test_a_silent_link_is_held_and_then_landed(bench: Bench) -> None:
    uav = bench(parameters={"LINK_LOSS": 1.0, "LINK_HOLD": 2.0}).flying()
    since_ns = uav.now_ns
    uav.heard = False
    seen: dict[str, int] = {}

    uav.run(10.0, lambda: seen.setdefault(uav.controller.state().failsafe, uav.now_ns - since_ns) and None)

    assert seen["link lost: hold"] / 1e9 == pytest.approx(1.0, abs=0.03)
    assert seen["link lost: land"] / 1e9 == pytest.approx(3.0, abs=0.05)
    assert not uav.controller.state().armed
    assert hypot(*uav.ned()[:2]) < 0.02


def test_a_link_that_comes_back_ends_the_hold_and_not_the_landing(bench: Bench) -> None:
    uav = bench(parameters={"LINK_LOSS": 1.0, "LINK_HOLD": 2.0}).flying()
    uav.heard = False
    uav.run(2.0)
    assert uav.controller.state().failsafe == "link lost: hold"
    uav.heard = True
    uav.run(3.0)

    assert (uav.controller.state().failsafe, uav.controller.state().mode) == ("", Mode.HOLD)
    uav.heard = False
    uav.run(3.5)
    uav.heard = True
    uav.run(5.0)
    assert not uav.controller.state().armed


def test_targets_that_fall_silent_end_in_a_hold(bench: Bench) -> None:
    uav = bench().flying()
    uav.fly_to(PositionTarget((5.0, 0.0, -1.0)), 2.0)
    uav.commanded = None

    uav.run(0.4)
    assert uav.controller.state().mode is Mode.OFFBOARD
    uav.run(3.0)

    assert (uav.controller.state().mode, uav.controller.state().failsafe) == (Mode.HOLD, "targets lost: hold")
    place = uav.ned()
    assert place[0] < 4.5
    assert worst(uav, 2.0, lambda: dist(uav.ned(), place)) < 0.03
    assert uav.controller.set_mode(Mode.HOLD) is Result.ACCEPTED
    assert uav.controller.state().failsafe == ""


@pytest.mark.parametrize("height_m", [0.6, 2.0])
def test_without_motion_capture_it_sinks_and_notices_the_ground(height_m: float, bench: Bench) -> None:
    uav = bench().flying(height_m)
    uav.captured = False
    speeds: list[float] = []

    uav.run(15.0, lambda: speeds.append(uav.plant.get("v[3]")))

    assert "motion capture lost: descend" in uav.notices
    assert (uav.controller.state().armed, uav.plant.get("on_ground")) == (False, 1.0)
    assert uav.controller.state().velocity_ned_mps == (0.0, 0.0, 0.0)
    assert min(speeds) > -0.6
    assert hypot(*uav.ned()[:2]) < 0.1          # it drifts with the velocity that it did not know, some mm/s


def test_motion_capture_that_is_lost_under_way_and_in_wind_stops_it_first(bench: Bench) -> None:
    uav = bench().flying(1.5)
    uav.plant.input_group(["wind[2]"]).write([-2.0])
    uav.run(6.0)
    uav.fly_to(PositionTarget(velocity_ned_mps=(1.0, 0.0, 0.0)), 2.0)
    uav.captured = False
    lost_at = uav.ned()

    uav.run(12.0)

    assert uav.plant.get("on_ground") == 1.0
    # 1 m/s for MOCAP_LOSS = 0.3 s, then dying away with POS_KD = 3.4 1/s behind the attitude's 0.12 s; drag: 3.3 m
    assert uav.ned()[0] - lost_at[0] < 1.0


def test_a_reference_does_not_run_away_from_a_vehicle_that_cannot_follow(bench: Bench) -> None:
    uav = bench().flying()
    uav.plant.input_group(["wind[2]"]).write([-25.0])           # 3.75 N of drag, the tilt gives 2.7 N
    far: list[float] = []
    uav.fly_to(PositionTarget((8.0, 0.0, -1.0)), 2.0, lambda: far.append(
        dist(uav.controller.loops.horizontal.position, uav.controller.state().position_ned_m[:2])))

    assert uav.ned()[0] < 0.0
    assert max(far) <= 1.0 + 1e-9 + 0.15            # motion capture moves the estimate a little after the leash is laid


def test_motion_capture_that_comes_back_lets_the_landing_end_in_place(bench: Bench) -> None:
    uav = bench().flying(2.0)
    uav.captured = False
    uav.run(1.0)
    uav.captured = True
    uav.run(12.0)

    assert not uav.controller.state().armed
    assert "landed" in uav.notices


def test_a_short_loss_of_motion_capture_is_flown_through(bench: Bench) -> None:
    uav = bench().flying()
    uav.captured = False
    uav.run(0.25)
    uav.captured = True

    assert worst(uav, 3.0, lambda: dist(uav.ned(), (0.0, 0.0, -1.0))) < 0.02
    assert uav.controller.state().mode is Mode.HOLD


# --- what is refused


def test_arming_is_refused_without_motion_capture_link_or_a_level_stand(bench: Bench) -> None:
    blind, silent = bench(), bench()
    blind.captured = False
    silent.heard = False

    for uav in (blind, silent):
        uav.run(2.5)
        assert uav.controller.arm() is Result.TEMPORARILY_REJECTED
        assert not uav.controller.state().armed

    assert blind.notices == ["arming refused: no motion capture"]
    assert silent.notices == ["arming refused: no link"]
    assert silent.controller.arm(force=True) is Result.ACCEPTED
    assert silent.run(1.9).controller.state().armed                 # the silence counts from there
    assert not silent.run(0.3).controller.state().armed
    assert blind.controller.arm(force=True) is Result.TEMPORARILY_REJECTED


def test_a_vehicle_that_is_thrown_tilted_is_not_armed(bench: Bench) -> None:
    uav = bench({"z": 9.0, "q": from_roll_pitch_yaw(0.5, 0.0, 0.0)}).run(0.2)

    assert uav.controller.arm() is Result.TEMPORARILY_REJECTED
    assert uav.notices == ["arming refused: not level"]


def test_what_makes_no_sense_now_is_refused_and_changes_nothing(bench: Bench) -> None:
    uav = bench().run(0.2)
    control = uav.controller

    results = [control.take_off(1.0), control.land(), control.set_mode(Mode.RETURN), control.set_mode(Mode.OFFBOARD),
               control.start_mission(), control.take_off(float("nan")), control.take_off(-1.0)]

    assert results == [Result.TEMPORARILY_REJECTED] * 4 + [Result.DENIED] * 3
    assert (control.state().mode, control.state().armed) == (Mode.HOLD, False)
    uav.flying()
    assert control.disarm() is Result.TEMPORARILY_REJECTED
    assert control.take_off(1.0) is Result.TEMPORARILY_REJECTED
    assert control.set_mode(Mode.STABILIZE) is Result.TEMPORARILY_REJECTED
    uav.run(0.5)
    assert dist(uav.ned(), (0.0, 0.0, -1.0)) < 0.02


def test_commands_that_come_twice_over_a_lossy_link_do_no_harm(bench: Bench) -> None:
    uav = bench().run(0.2)
    uav.controller.load_mission([MissionItem(ItemKind.WAYPOINT, (0.0, 0.0, -1.2), hold_s=2.0)])

    assert [uav.controller.arm(), uav.controller.arm()] == [Result.ACCEPTED] * 2
    assert uav.controller.take_off(1.0) is Result.ACCEPTED
    uav.run(0.5)
    assert uav.controller.take_off(1.0) is Result.ACCEPTED
    uav.run(4.0)
    assert uav.ned()[2] == pytest.approx(-1.0, abs=0.05)
    assert uav.controller.start_mission() is Result.ACCEPTED
    uav.run(1.5)
    assert uav.controller.start_mission() is Result.ACCEPTED            # the hold goes on, it does not begin anew
    uav.run(1.8)
    assert uav.controller.state().waypoint_index == 1
    assert [uav.controller.land(), uav.controller.land()] == [Result.ACCEPTED] * 2


def test_it_can_be_stopped_in_the_air_by_force(bench: Bench) -> None:
    uav = bench().flying()

    assert uav.controller.disarm(force=True) is Result.ACCEPTED
    uav.run(1.0)

    assert uav.ned()[2] == 0.0


def test_what_it_was_about_to_do_when_it_was_stopped_is_forgotten(bench: Bench) -> None:
    uav = bench().run(0.2)
    uav.controller.arm()
    uav.controller.take_off(2.0)
    uav.run(1.0)
    uav.controller.disarm(force=True)
    uav.run(2.0)

    assert uav.controller.arm() is Result.ACCEPTED
    uav.run(2.0)

    assert uav.ned()[2] == 0.0


def test_a_mission_that_is_replaced_or_cleared_before_the_start_is_not_flown(bench: Bench) -> None:
    uav = bench().run(0.2)
    items = [MissionItem(ItemKind.TAKEOFF, (0.0, 0.0, -1.0))]
    assert uav.controller.load_mission(items) is Result.ACCEPTED
    assert uav.controller.start_mission() is Result.ACCEPTED

    assert uav.controller.load_mission([]) is Result.ACCEPTED
    assert uav.controller.arm() is Result.ACCEPTED
    uav.run(1.0)

    assert uav.controller.state().mode is Mode.HOLD
    assert uav.ned() == (0.0, 0.0, 0.0)


def test_a_mission_that_is_flown_is_not_replaced(bench: Bench) -> None:
    uav = bench().run(0.2)
    uav.controller.load_mission([MissionItem(ItemKind.TAKEOFF, (0.0, 0.0, -1.0))])
    uav.controller.start_mission()
    uav.controller.arm()
    uav.run(0.5)

    assert uav.controller.load_mission([]) is Result.TEMPORARILY_REJECTED
    assert len(uav.controller.mission) == 1


def test_a_stream_of_targets_that_has_ended_does_not_start_it(bench: Bench) -> None:
    uav = bench().run(0.2)
    uav.controller.target(PositionTarget((0.0, 0.0, -1.0)), uav.board.now_ns)
    assert uav.controller.set_mode(Mode.OFFBOARD) is Result.ACCEPTED
    uav.run(1.0)

    assert uav.controller.arm(force=True) is Result.TEMPORARILY_REJECTED
    uav.controller.target(PositionTarget((0.0, 0.0, 0.0)), uav.board.now_ns)
    assert uav.controller.arm() is Result.ACCEPTED
    uav.run(2.0)
    assert uav.ned() == (0.0, 0.0, 0.0)


def test_thrust_that_lifts_nothing_leaves_it_on_the_ground_to_be_disarmed(bench: Bench) -> None:
    uav = bench().run(0.2)
    assert uav.controller.set_mode(Mode.STABILIZE) is Result.ACCEPTED
    assert uav.controller.arm() is Result.ACCEPTED
    uav.commanded = AttitudeTarget((1.0, 0.0, 0.0, 0.0), None, 0.15)       # hovers at 0.33
    uav.run(1.0)
    assert uav.controller.state().landed is Landed.TAKING_OFF
    uav.commanded = AttitudeTarget((1.0, 0.0, 0.0, 0.0), None, 0.0)
    uav.run(1.0)

    assert uav.controller.state().landed is Landed.ON_GROUND
    assert uav.controller.disarm() is Result.ACCEPTED


def test_armed_in_stabilize_it_waits_for_its_first_target(bench: Bench) -> None:
    uav = bench().run(0.2)
    uav.controller.target(AttitudeTarget((1.0, 0.0, 0.0, 0.0), None, 0.8), uav.board.now_ns)    # long ago
    uav.run(1.0)
    uav.controller.set_mode(Mode.STABILIZE)
    uav.controller.arm()
    uav.run(3.0)

    assert uav.controller.state().armed
    assert uav.ned() == (0.0, 0.0, 0.0)


def test_positions_are_no_targets_for_stabilize(bench: Bench) -> None:
    uav = bench().flying()
    uav.commanded = AttitudeTarget(from_roll_pitch_yaw(0.0, 0.0, pi / 2), None, 0.33)
    uav.run(0.1)
    assert uav.controller.set_mode(Mode.STABILIZE) is Result.ACCEPTED
    uav.commanded = PositionTarget((3.0, 0.0, -1.0))
    uav.run(2.0)

    assert (uav.controller.state().mode, uav.controller.state().failsafe) == (Mode.HOLD, "targets lost: hold")
    assert abs(uav.ned()[0]) < 0.2


def test_armed_and_forgotten_it_disarms_itself(bench: Bench) -> None:
    uav = bench(parameters={"DISARM_IDLE": 2.0}).run(0.2)
    uav.controller.arm()

    uav.run(1.9)
    assert uav.controller.state().armed
    uav.run(0.3)

    assert not uav.controller.state().armed
    assert uav.ned() == (0.0, 0.0, 0.0)


def test_a_target_beyond_the_fence_is_clipped_told_and_flown(bench: Bench) -> None:
    uav = bench(parameters={"FENCE_XY": 1.0, "FENCE_ALT": 1.5}).flying()

    said = uav.controller.target(PositionTarget((5.0, 0.0, -9.0)), uav.board.now_ns)
    uav.fly_to(PositionTarget((5.0, 0.0, -9.0)), 6.0)

    assert said == ["position north 5 clipped to 1", "position down -9 clipped to -1.5"]
    assert uav.ned() == pytest.approx((1.0, 0.0, -1.5), abs=0.05)


def test_targets_that_are_no_numbers_change_nothing_and_feed_no_stream(bench: Bench) -> None:
    uav = bench().flying()
    uav.fly_to(PositionTarget((0.0, 0.0, -1.0)), 1.0)

    uav.commanded = PositionTarget((float("nan"), 0.0, -1.0))
    said = uav.controller.target(uav.commanded, uav.board.now_ns)
    uav.run(1.0)

    assert said == ["position north is not finite: refused"]
    assert uav.controller.state().failsafe == "targets lost: hold"
    assert dist(uav.ned(), (0.0, 0.0, -1.0)) < 0.02
