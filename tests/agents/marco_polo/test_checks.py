"""Each refusal names place and value, and the number that it gives would do."""

import re
from dataclasses import replace

import pytest

from agents.marco_polo.cells import Cells
from agents.marco_polo.checks import (
    check_area_coverage,
    check_detections,
    check_entrances,
    check_exits,
    check_obstacles,
    check_pursuers,
    check_starts,
)
from agents.marco_polo.game_parameters import GameParameters
from tests.agents.marco_polo.layouts import AREA, OBSTACLE, RADII, ZONE

CELLS = Cells(AREA, 0.5)
DENT = ((1.0, 1.0), (4.0, 1.0), (4.0, 4.0), (3.0, 2.0))
NUMBER = r"-?\d+(?:\.\d+)?(?:e-?\d+)?"


def places(text):
    """All places "(x, y)" of a message."""
    return [(float(x), float(y)) for x, y in re.findall(rf"\(({NUMBER}), ({NUMBER})\)", text)]


def refusal(check, *arguments, **more):
    with pytest.raises(ValueError) as raised:
        check(*arguments, **more)
    return str(raised.value)


def test_k_above_the_number_of_sensors_and_a_team_without_ugv():
    assert "detections=8:" in refusal(check_detections, 8, 7)
    assert "take 7 or less" in refusal(check_detections, 8, 7)
    check_detections(7, 7)
    assert "team.sensors: 0 UGVs" in refusal(check_pursuers, 0, place="team.sensors")
    check_pursuers(1)


def test_more_area_coverage_than_the_radii_can_give():
    text = refusal(check_area_coverage, AREA, RADII, 0.34)

    check_area_coverage(AREA, RADII, float(re.search(r"take ([0-9.]+) or less", text)[1]))
    assert "0.3338" in text
    assert "least_area_coverage=0.34" in text


def test_obstacles_that_leave_targets_no_entrance():
    walls = [((0.0, 0.0), (10.0, 0.0), (10.0, 1.0)), ((10.0, 0.0), (10.0, 10.0), (9.0, 10.0)),
             ((0.0, 0.0), (0.0, 10.0), (0.5, 5.0)), ((0.0, 10.0), (9.7, 10.0), (5.0, 9.8))]     # but for the last 0.3 m

    text = refusal(check_entrances, AREA, walls)

    free_m = float(re.search(r"of it free, ([0-9.]+) m", text)[1])
    assert free_m == 0.4
    check_entrances(AREA, [*walls[:3], ((0.0, 10.0), (10.0 - 1.0 - free_m, 10.0), (5.0, 9.8))])
    check_entrances(AREA, [])


def test_an_obstacle_that_is_not_convex():
    text = refusal(check_obstacles, [OBSTACLE, DENT], AREA)

    assert text.startswith("obstacles[1]=")
    assert "corner (3, 2) m lies 0.707 m inside" in text
    hull = places(text.split("take the hull,")[1])
    assert set(hull) == set(DENT) - {(3.0, 2.0)}
    check_obstacles([OBSTACLE, hull], AREA)


@pytest.mark.parametrize(("corners", "why"), [
    (((0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)), "sides cross"), (((0.0, 0.0), (1.0, 1.0)), "3 or more corners"),
    (((0.0, 0.0), (1.0, 1.0), (2.0, 2.0)), "on a line"), (((0.0, 0.0), (1.0, 0.0), (0.0, float("nan"))), "finite")])
def test_corners_that_bound_no_convex_polygon(corners, why):
    assert why in refusal(check_obstacles, [corners], AREA)


@pytest.mark.parametrize("corners", [(*OBSTACLE, OBSTACLE[0]), (OBSTACLE[0], *OBSTACLE),
                                     (*OBSTACLE, (OBSTACLE[0][0] + 1e-12, OBSTACLE[0][1]))])
def test_a_corner_that_is_given_twice_in_a_row(corners):
    text = refusal(check_obstacles, [corners], AREA)

    assert "corner (3, 3) m is given twice in a row" in text
    check_obstacles([OBSTACLE], AREA)


def test_an_obstacle_that_protrudes():
    text = refusal(check_obstacles, [((9.0, 9.0), (11.0, 9.0), (9.0, 9.5))], AREA, place="zones")

    assert text.startswith("zones[0]: corner (11, 9)")
    assert places(text)[-1] == (10.0, 9.0)


def test_obstacles_in_either_direction_and_with_corners_on_a_side_are_convex():
    check_obstacles([OBSTACLE, OBSTACLE[::-1], (*OBSTACLE[:1], (5.0, 3.0), *OBSTACLE[1:])], AREA)


@pytest.mark.parametrize(("start", "kind"), [((3.1, 5.0), "obstacle 0"), ((8.0, 3.0), "zone 0"),
                                             ((0.1, 5.0), "protrudes")])
def test_a_start_that_overlaps(start, kind):
    def check(place):
        check_starts(CELLS, {"ugv1": (1.0, 1.0), "ugv2": place}, [OBSTACLE], [ZONE], 0.5)

    text = refusal(check, start)

    assert text.startswith("starts.ugv2=")
    assert kind in text
    check(places(text)[-1])


def test_an_aerial_sensor_may_start_over_an_obstacle_but_not_in_a_zone():
    check_starts(CELLS, {"uav1": (5.0, 5.0)}, [OBSTACLE], [ZONE], 0.5, frozenset({"uav1"}))

    assert "zone 0" in refusal(check_starts, CELLS, {"uav1": (8.0, 3.0)}, [OBSTACLE], [ZONE], 0.5, frozenset({"uav1"}))


def test_an_area_without_a_free_cell():
    everything = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))

    assert "no cell is free" in refusal(check_starts, CELLS, {"ugv1": (5.0, 5.0)}, [everything], [], 0.5)


WALL = ((0.0, 6.0), (10.0, 6.0), (10.0, 7.0), (0.0, 7.0))


def test_an_exit_that_no_ugv_can_reach():
    text = refusal(check_exits, CELLS, {"ugv1": (1.0, 1.0)}, [WALL], [], 0.5)

    assert "exit at (0.25, 7.25)" in text
    assert "the nearest place within is (0.25, 5.75) m, 1.5 m away" in text
    assert "gap of 0.5 m" in text
    check_exits(CELLS, {"ugv1": (1.0, 1.0), "ugv2": (5.0, 9.0)}, [WALL], [], 0.5)
    check_exits(CELLS, {"ugv1": (1.0, 1.0)}, [((0.0, 6.0), (9.5, 6.0), (9.5, 7.0), (0.0, 7.0))], [], 0.5)


def test_exits_of_ugvs_that_start_in_no_free_cell():
    text = refusal(check_exits, CELLS, {"ugv1": (5.0, 6.5)}, [WALL], [], 0.5)

    assert "no UGV of ['ugv1'] starts in a free cell" in text
    assert places(text)[-1] == (0.25, 0.25)


@pytest.mark.parametrize(("change", "why"), [
    ({"detections": 1}, "k is 2 or more"), ({"cell_m": 0.0}, "cell_m=0.0"), ({"cone_content": 1.0}, "cone_content"),
    ({"detection_threshold": 1.0}, "detection_threshold"), ({"least_area_coverage": 1.1}, "least_area_coverage"),
    ({"target_least_mps": 0.8}, "take 0.8 or more"), ({"turn_greatest_ns": 1}, "take 2000000000 or more"),
    ({"ugv_mps": 0.7}, "make it faster"), ({"uav_mps": 1.2}, "more than 1.2"), ({"update_ns": 0}, "update_ns"),
    ({"ugv_mps": float("nan")}, "ugv_mps=nan")])
def test_constants_that_make_no_game(change, why):
    assert why in refusal(replace, GameParameters(), **change)
