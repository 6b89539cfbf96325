"""Platforms driven along places: they arrive, stop within their braking distance, and know their place."""

from __future__ import annotations

import json
from itertools import pairwise
from math import cos, dist, hypot, log, pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from agents.marco_polo_game.movers.differential_drive import (
    STILL_MPS,
    TURN_PER_S,
    DifferentialDriveSettings,
)
from agents.marco_polo_game.movers.omnidirectional import OmnidirectionalSettings
from agents.marco_polo_game.movers.quadrotor import QuadrotorSettings
from agents.marco_polo_game.movers.way import braking, corner_mps, room_m, straightened
from agents.pursuit.law import Area
from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario.loader import load_tables

S = 1_000_000_000
SAMPLE_NS = 50_000_000
AREA = Area((0.0, 10.0), (0.0, 10.0))
PLACES = st.tuples(st.floats(0.0, 10.0), st.floats(0.0, 10.0))

# --- a P3-AT with faster wheels, as in the scenario marco_polo_platforms

SPEED_MPS, WHEELS_MPS2, ACCEL_MPS2, OMEGA_RADPS, TRACK_M = 1.2, 0.29, 0.2, 1.0, 0.573
DELAY_S = 0.2                   # until the wheels follow: mover 0.05, CAN < 0.001, drive 0.0103, wheels 0.1
DRIVE = DifferentialDriveSettings("can", (5.0, 5.0, 0.0), WHEELS_MPS2, ACCEL_MPS2)

# Near the goal v = k d until v < STILL_MPS. With a delay r and k r < 1 / e that does not overshoot, and what has braked
# by a before is a r^2 / 2 farther on.
ARRIVED_M = STILL_MPS / DRIVE.gain_per_s + ACCEL_MPS2 * DELAY_S ** 2 / 2


def driven(out: Path, length_s: float, start: tuple[float, float, float] = (5.0, 5.0, 0.0),
           **driver: Any) -> dict[str, NDArray[np.float64]]:
    """Return the signals of the drive and, as "told NAME", of the program, by name; "t" has their times in s."""
    x, y, theta = start
    return played(out, length_s, {
        "program": {"program": "tests.agents.marco_polo_game.drivers:Driver", "media": ["can"], "parameters": {
            "speed_mps": SPEED_MPS, "drive": {"can": "can", "start": list(start), "wheel_mps2": WHEELS_MPS2,
                                              "accel_mps2": ACCEL_MPS2, "odometry_age_ns": 300_000}, **driver}},
        "body": {"program": "firmware_sim.drive_controller.drive_controller:DriveController", "media": ["can"],
                 "parameters": {"lag_ms": 100, "ramp_radps2": 2.7, "command_max_radps": 10.95,
                                "counts_per_turn": 95_380, "odometry_every": 5, "stale_after_ms": 500},
                 "plant": {"fmu": "unicycle", "preset": "p3at",
                           "parameters": {"speed_max_mps": SPEED_MPS, "x": x, "y": y, "theta": theta}}}},
        {"can": {"kind": "can", "bit_rate_bps": 500_000}})


def played(out: Path, length_s: float, agents: dict[str, Any], media: dict[str, Any]) -> dict[str, NDArray[np.float64]]:
    scenario = load_tables({
        "seed": 1, "length_s": length_s, "sample_period_ns": SAMPLE_NS, "media": media,
        "agents": json.loads(json.dumps(agents)),
        "team": {"robot": {"wheel_radius_m": 0.11, "track_m": TRACK_M, "counts_per_turn": 95_380}}},
        "Question: where is it?", Path("mover.toml").absolute())
    run(scenario, host="inline", out=out, report=False)
    data, found = load_run(out), {}
    for node, prefix in (("body", ""), ("program", "told ")):
        if node in data.signals:
            table = data.signals[node]
            found |= {f"{prefix}{name}": np.asarray(table.values)[:, column]
                      for column, name in enumerate(table.names)}
            found["t"] = np.asarray(table.time_ns) * 1e-9
    return found


@pytest.mark.parametrize("bearing_rad", [0.0, 0.4, 0.5 * pi, 2.0, pi, -1.2])
def test_a_differential_drive_arrives_in_time_from_any_heading(bearing_rad: float, tmp_path: Path) -> None:
    way_m = 3.0
    goal = 5.0 + way_m * cos(bearing_rad), 5.0 + way_m * sin(bearing_rad)
    # It turns by a right angle at most, forwards or backwards: faster with all that its wheels can do, slower with what
    # braking leaves. Then it speeds up, brakes, and rolls out by v = k d, later by its delay; never away from the goal.
    half_m = TRACK_M / 2
    ends_s, alpha = [half_m / WHEELS_MPS2, 1 / DRIVE.alpha_radps2(half_m)], DRIVE.alpha_radps2(half_m)
    turn_s = sqrt(pi / sum(ends_s)) * sum(ends_s) + log(alpha / TURN_PER_S / 0.02) / TURN_PER_S
    drive_s = sqrt(2 * way_m * (1 / WHEELS_MPS2 + 1 / ACCEL_MPS2))
    due_s = 1.0 + turn_s + drive_s + log(ACCEL_MPS2 / DRIVE.gain_per_s / STILL_MPS) / DRIVE.gain_per_s + 2 * DELAY_S

    found = driven(tmp_path / "run", due_s + 1.0, go_ns=[S], ways=[[goal]])

    late = found["t"] >= due_s
    assert np.hypot(found["x"] - goal[0], found["y"] - goal[1])[late].max() <= ARRIVED_M
    assert np.abs(found["v"][late]).max() < 2 * pi / 95_380 * 0.11 / 0.01      # less than one count in a period


@pytest.mark.parametrize("way", [[(8.5, 5.0), (8.5, 8.5)], [(2.0, 6.0), (1.5, 2.0), (4.0, 0.5)]])
def test_a_differential_drive_passes_each_corner_and_stops_at_the_last(way: list[tuple[float, float]],
                                                                     tmp_path: Path) -> None:
    found = driven(tmp_path / "run", 40.0, go_ns=[S], ways=[way])

    path = np.stack([found["x"], found["y"]], axis=1)
    for corner in way[:-1]:                 # within reach, and what it drives between two samples
        assert np.hypot(*(path - corner).T).min() <= DRIVE.reach_m + SPEED_MPS * SAMPLE_NS * 1e-9
    assert dist(path[-1], way[-1]) <= ARRIVED_M


@pytest.mark.parametrize("after_s", [1.0, *(pytest.param(s, marks=pytest.mark.slow) for s in (2.0, 4.5))])
def test_a_differential_drive_stops_within_its_bound_and_then_stands(after_s: float, tmp_path: Path) -> None:
    found = driven(tmp_path / "run", after_s + 8.0, (1.0, 1.0, 0.7), go_ns=[S], ways=[[(9.0, 9.0)]],
                   stop_ns=[S + round(after_s * S)])

    stopped = found["t"] >= 1.0 + after_s
    path = np.stack([found["x"], found["y"]], axis=1)[stopped]
    way_m, v = np.hypot(*(path - path[0]).T), float(found["v"][stopped][0])
    assert v > 0.1                          # it was under way
    assert way_m.max() <= v * DELAY_S + (v + WHEELS_MPS2 * DELAY_S) ** 2 / (2 * WHEELS_MPS2)
    assert way_m.max() <= DRIVE.bounds(SPEED_MPS).coasts_m
    assert np.ptp(way_m[-10:]) < 1e-6
    assert found["told coasted"][stopped][-1] == pytest.approx(way_m[-1], abs=SPEED_MPS * SAMPLE_NS * 1e-9)


def test_a_differential_drive_knows_its_place_and_keeps_to_its_speed(tmp_path: Path) -> None:
    ways = [[(9.0, 9.0)], [(1.0, 8.0), (1.0, 1.0)], [(6.0, 6.0)]]
    found = driven(tmp_path / "run", 40.0, go_ns=[S, 6 * S, 20 * S], ways=ways, stop_ns=[32 * S])

    bounds = DRIVE.bounds(SPEED_MPS)
    off_m = np.hypot(found["told x"] - found["x"], found["told y"] - found["y"])
    # Between readings 50 ms apart it goes on with the mean of the last interval: a T (T + T / 2) too far at most. At a
    # reading the arc between two differs from the way by its change of curvature, a 2 / track T^3 v / 24; 800 of them.
    drift_m = 800 * WHEELS_MPS2 * 2 / TRACK_M * 0.05 ** 3 * SPEED_MPS / 24
    assert off_m.max() <= 1.5 * WHEELS_MPS2 * 0.05 ** 2 + drift_m
    for axis in ("told x", "told y"):
        assert np.abs(np.diff(found[axis])).max() <= bounds.speed_mps * SAMPLE_NS * 1e-9
    assert max(np.abs(found["wheel_left"]).max(), np.abs(found["wheel_right"]).max()) * 0.11 <= SPEED_MPS + 1e-9


@pytest.mark.parametrize("goal", [(10.0, 5.0), (10.0, 10.0), (5.0, 0.0)])
def test_a_differential_drive_keeps_to_the_area(goal: tuple[float, float], tmp_path: Path) -> None:
    back = (2.0, 5.0)
    found = driven(tmp_path / "run", 30.0, (5.0, 5.0, 0.3), go_ns=[S, 8 * S], ways=[[goal], [back]])

    outside_m = max(max(-found[axis].min(), found[axis].max() - 10.0) for axis in ("x", "y"))
    assert outside_m <= ARRIVED_M           # straight to the boundary, it brakes there as at any goal
    assert hypot(found["x"][-1] - back[0], found["y"][-1] - back[1]) <= ARRIVED_M


# --- a Hummingbird behind MAVLink

FLIGHT = QuadrotorSettings("line", (2.5, 2.5, 0.0))
UAV_MPS = 2.0


def flown(out: Path, length_s: float, **driver: Any) -> dict[str, NDArray[np.float64]]:
    return played(out, length_s, {
        "program": {"program": "tests.agents.marco_polo_game.drivers:Driver", "media": ["line"], "parameters": {
            "speed_mps": UAV_MPS, "flight": {"link": "line", "start": [2.5, 2.5, 0.0], "position_age_ns": 5_000_000},
            **driver}},
        "body": {"program": "firmware_sim.mavlink.mavlink_autopilot:MavlinkAutopilot", "media": ["mocap", "line"],
                 "plant": {"fmu": "quadrotor", "preset": "hummingbird", "parameters": {"x": 2.5, "y": 2.5}},
                 "parameters": {"autopilot": {"parameters": {"VEL_MAX": UAV_MPS, "MIS_TAKEOFF_ALT": 1.5}},
                                "mavlink": {"port": "line", "period_ms": 10}}}},
        {"line": {"kind": "serial_line", "baud_bps": 115_200},
         "mocap": {"kind": "sensing", "exposure_period_ms": 10, "latency_ms": 10, "noise_m": 0.001,
                   "bodies": {"body": ["x", "y", "z", "heading"]}, "fixed_cameras": ["body"],
                   "every_exposure_to": ["body"]}})


def test_a_quadrotor_goes_where_it_was_told_before_it_flew_and_on_along_the_places(tmp_path: Path) -> None:
    way = [(5.0, 2.5), (5.0, 7.0), (8.0, 7.0)]
    found = flown(tmp_path / "run", 20.0, go_ns=[S, 10 * S], ways=[[(4.0, 2.5)], way])

    t, path = found["t"], np.stack([found["x"], found["y"]], axis=1)
    assert hypot(*(path[t <= 10.0][-1] - (4.0, 2.5))) <= 0.05       # within centimetres: see test_a_quadrotor_stops
    for place in way[:-1]:
        assert np.hypot(*(path - place).T).min() <= FLIGHT.reach_m + UAV_MPS * SAMPLE_NS * 1e-9
    # Each leg from rest to rest is slower than the way with its corners: d / v + v / a for the ramp, and its delay.
    legs_m = [dist(one, other) for one, other in pairwise([(4.0, 2.5), *way])]
    due_s = 10.0 + sum(leg / UAV_MPS + UAV_MPS / FLIGHT.accel_mps2 for leg in legs_m)
    assert due_s < 19.0
    assert np.hypot(*(path[t >= due_s] - way[-1]).T).max() <= FLIGHT.error_m
    assert hypot(*(path[-1] - way[-1])) <= 0.05


def test_a_quadrotor_that_flies_to_and_fro_keeps_its_bounds(tmp_path: Path) -> None:
    found = flown(tmp_path / "run", 24.0, go_ns=[8 * S, 12 * S, 14 * S, 18 * S], stop_ns=[16 * S, 20 * S],
                  ways=[[(9.0, 2.5)], [(2.5, 2.5)], [(9.0, 2.5)], [(2.0, 2.5)]])

    bounds, chase = FLIGHT.bounds(UAV_MPS), found["t"] > 8.0
    every = 100_000_000 // SAMPLE_NS                                # samples of the scenario
    for axis in ("told x", "told y"):
        assert np.abs(found[axis][every:] - found[axis][:-every]).max() <= bounds.speed_mps * 0.1
    assert np.hypot(found["ref_east"] - found["x"], found["ref_north"] - found["y"])[chase].max() <= FLIGHT.error_m
    assert found["told coasted"].max() <= bounds.coasts_m
    assert found["told coasted"].max() > 1.0


@pytest.mark.parametrize("after_s", [0.5, pytest.param(1.5, marks=pytest.mark.slow)])
def test_a_quadrotor_stops_within_its_bound_and_then_stands(after_s: float, tmp_path: Path) -> None:
    found = flown(tmp_path / "run", 16.0, go_ns=[8 * S], ways=[[(9.0, 9.0)]], stop_ns=[8 * S + round(after_s * S)])

    bounds, t = FLIGHT.bounds(UAV_MPS), found["t"]
    stopped = t >= 8.0 + after_s
    path = np.stack([found["x"], found["y"]], axis=1)[stopped]
    way_m = np.hypot(*(path - path[0]).T)
    assert hypot(found["v[1]"][stopped][0], found["v[2]"][stopped][0]) > 0.3
    assert way_m.max() <= bounds.coasts_m
    assert found["told coasted"].max() <= bounds.coasts_m
    assert np.ptp(way_m[-20:]) < 0.02                               # hovers: 4 sigma and more of motion capture, 1 mm


def test_an_omnidirectional_platform_is_bound_to_stand_where_it_stops() -> None:
    bounds = OmnidirectionalSettings().bounds(1.2)

    assert (bounds.speed_mps, bounds.coasts_m) == (1.2, 0.0)


# --- the way

@given(PLACES, st.lists(PLACES, min_size=1, max_size=12), st.floats(0.0, 0.5))
def test_a_straightened_way_ends_where_it_should_and_leaves_no_place_aside(
        own: tuple[float, float], places: list[tuple[float, float]], aside_m: float) -> None:
    way = straightened(own, places, aside_m)

    assert way[-1] == places[-1]
    assert set(way) <= set(places)
    legs, left = [own, *way], list(places)
    for one, other in pairwise(legs):                   # in order: each leg passes the places up to its own end
        passed, left = left[:left.index(other) + 1], left[left.index(other) + 1:]
        assert max(apart_m(place, one, other) for place in passed) <= aside_m + 1e-9
    assert not left or set(left) == {places[-1]}


def test_a_way_to_and_fro_keeps_its_turns_and_a_straight_one_its_end() -> None:
    to_and_fro = [(1.0, 0.0), (-1.0, 0.0), (1.0, 0.0), (-1.0, 0.0)]

    assert straightened((0.0, 0.0), to_and_fro, 0.1) == to_and_fro
    assert straightened((0.0, 0.0), [(0.5, 0.05), (1.0, 0.0), (1.5, -0.05), (2.0, 0.0)], 0.1) == [(2.0, 0.0)]
    assert straightened((0.0, 0.0), [(1.0, 0.0), (1.0, 1.0)], 0.1) == [(1.0, 0.0), (1.0, 1.0)]


def apart_m(place: tuple[float, float], one: tuple[float, float], other: tuple[float, float]) -> float:
    """Return the distance of a place from the leg between two others."""
    along, leg = np.subtract(place, one), np.subtract(other, one)
    share = min(1.0, max(0.0, float(along @ leg) / max(float(leg @ leg), 1e-300)))
    return float(np.hypot(*(along - share * leg)))


@given(st.floats(0.01, 20.0), st.floats(0.1, 3.0))
def test_the_braking_law_comes_to_rest_without_braking_harder(way_m: float, accel_mps2: float) -> None:
    left, dt_s, last = way_m, 1e-3, braking(way_m, accel_mps2, 1.0)
    for _ in range(2000):
        left -= last * dt_s
        v = braking(left, accel_mps2, 1.0)
        assert (last ** 2 - v ** 2) / 2 <= accel_mps2 * last * dt_s * (1 + 1e-9)        # energy over the way
        last = v

    assert left >= 0.0


def test_a_corner_is_taken_on_an_arc_and_a_straight_place_at_any_speed() -> None:
    straight, corner, _ = corner_mps((0.0, 0.0), [(5.0, 0.0), (10.0, 0.0), (10.0, 9.0)], 0.25, 1.0, 0.5, 1.0)

    assert corner == pytest.approx(0.25)                        # right angle: R = reach, v = omega R
    assert straight == pytest.approx(sqrt(0.25 ** 2 + 2 * 0.5 * 5.0))


@given(PLACES, st.floats(-pi, pi))
def test_the_room_ahead_ends_at_the_boundary(own: tuple[float, float], heading_rad: float) -> None:
    room = room_m(own, heading_rad, AREA)

    x, y = own[0] + room * cos(heading_rad), own[1] + room * sin(heading_rad)
    assert AREA.nearest((x, y)) == pytest.approx((x, y), abs=1e-9)
    assert min(abs(x), abs(x - 10.0), abs(y), abs(y - 10.0)) < 1e-9


def test_outside_there_is_no_room_for_who_leads_away() -> None:
    assert room_m((10.1, 5.0), 0.3, AREA) == 0.0
    assert room_m((10.1, 5.0), pi, AREA) == pytest.approx(10.1)
