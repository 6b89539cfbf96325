"""Geometry against hand-made cases and against brute force along the line of sight."""

from math import cos, hypot, pi, sin
from random import Random

import pytest

from netem.core.fate import Fate
from netem.media.sensing.field_of_view import FieldOfView, Obstacle
from netem.media.sensing.sight import Body


def at(x_m: float, y_m: float, heading_rad: float = 0.0, z_m: float = 0.0) -> Body:
    return Body(x_m, y_m, z_m, heading_rad)


@pytest.mark.parametrize(("distance_m", "fate"), [(2.0, None), (2.0 + 1e-9, Fate.OUT_OF_VIEW)])
def test_the_range_belongs_to_the_view_and_height_does_not_count(distance_m, fate):
    view = FieldOfView(range_m=2.0)

    assert view.fate(at(1.0, 1.0, z_m=7.0), at(1.0, 1.0 + distance_m)) is fate


@pytest.mark.parametrize("heading_rad", [0.0, 1.0, pi, -pi, 3 * pi, 100.0])
@pytest.mark.parametrize(("aside_deg", "fate"), [(0, None), (29.9, None), (-29.9, None), (30.1, Fate.OUT_OF_VIEW),
                                                 (-30.1, Fate.OUT_OF_VIEW), (180, Fate.OUT_OF_VIEW)])
def test_a_sector_lies_to_both_sides_of_the_heading_however_often_it_turned(heading_rad, aside_deg, fate):
    angle = heading_rad + aside_deg * pi / 180

    assert FieldOfView(5.0, 30.0).fate(at(0.3, -0.2, heading_rad), at(0.3 + cos(angle), -0.2 + sin(angle))) is fate


def test_what_stands_where_the_camera_stands_is_seen():
    assert FieldOfView(1.0, 10.0).fate(at(1.0, 1.0, 2.0), at(1.0, 1.0)) is None


def test_an_obstacle_hides_what_brute_force_along_the_line_of_sight_says():
    rng = Random("obstacles")
    points = 2_000
    hidden = 0

    for _ in range(300):
        camera, body = at(rng.uniform(-3, 3), rng.uniform(-3, 3)), at(rng.uniform(-3, 3), rng.uniform(-3, 3))
        obstacle = Obstacle((rng.uniform(-2, 2), rng.uniform(-2, 2)), rng.uniform(0.2, 1.0))
        away_m = min(hypot(camera.x_m + k / points * (body.x_m - camera.x_m) - obstacle.at_m[0],
                           camera.y_m + k / points * (body.y_m - camera.y_m) - obstacle.at_m[1])
                     for k in range(points + 1))
        between_m = hypot(6, 6) / points / 2        # the true minimum is less than the sampled one by no more
        if obstacle.radius_m - between_m <= away_m <= obstacle.radius_m + between_m:
            continue
        fate = FieldOfView(obstacles=(obstacle,)).fate(camera, body)
        assert (fate is Fate.OCCLUDED) == (away_m < obstacle.radius_m)
        hidden += fate is Fate.OCCLUDED

    assert 30 < hidden < 270


@pytest.mark.parametrize("wrong", [{"range_m": 0.0}, {"range_m": float("nan")}, {"half_angle_deg": 0.0},
                                   {"half_angle_deg": 181.0}])
def test_a_view_of_nothing_is_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        FieldOfView(**wrong)
