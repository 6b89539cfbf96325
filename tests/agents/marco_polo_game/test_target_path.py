"""The way of a target: where it enters, how it turns, where it leaves; distributions against section 2.4."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import cos, hypot, pi, sin, sqrt
from random import Random

import pytest
import shapely

from agents.marco_polo.cells import Polygon
from agents.marco_polo.game_parameters import GameParameters
from agents.marco_polo_game.target_path import TRAPPED, Ending, Leg, TargetPath, entrance
from agents.pursuit.law import Area

AREA = Area((-1.0, 3.0), (2.0, 8.0))         # 4 x 6 m, so that sides cannot be confused
GAME = GameParameters()
PATHS = 2000


def way(seed: int, obstacles: Sequence[Polygon] = (), most: int = 100) -> list[Leg]:
    path = TargetPath(AREA, GAME, Random(seed), obstacles)
    legs = [path.leg]
    while legs[-1].ending is not Ending.LEAVES and len(legs) < most:
        legs.append(path.turn())
    return legs


@pytest.mark.parametrize(("share", "place", "heading_rad"), [
    (0.0, (-1.0, 2.0), 0.5 * pi), (0.1, (1.0, 2.0), 0.5 * pi),              # 2 of 20 m along the south wall
    (0.35, (3.0, 5.0), pi), (0.6, (1.0, 8.0), -0.5 * pi), (0.85, (-1.0, 5.0), 0.0)])
def test_entrances_go_round_the_boundary_and_face_inwards(share: float, place: tuple[float, float],
                                                          heading_rad: float) -> None:
    found, inward_rad = entrance(AREA, share)

    assert found == pytest.approx(place)
    assert inward_rad == heading_rad


@pytest.mark.parametrize("seed", range(200))
def test_legs_join_keep_their_limits_and_end_at_the_boundary(seed: int) -> None:
    legs = way(seed)

    first_rad = legs[0].heading_rad
    for leg in legs:
        assert abs(leg.heading_rad - first_rad) <= 0.5 * pi
        assert leg.off_rad == pytest.approx(leg.heading_rad - first_rad)
        assert leg.speed_mps == legs[0].speed_mps
        assert leg.lasts_ns <= GAME.turn_greatest_ns
        assert leg.ending is Ending.LEAVES or leg.lasts_ns >= GAME.turn_least_ns
        assert AREA.nearest(leg.end) == pytest.approx(leg.end, abs=1e-8)        # inside, but for 1 ns of rounding
    for one, later in pairwise(legs):
        assert later.place == pytest.approx(one.end, abs=1e-8)
    assert GAME.target_least_mps <= legs[0].speed_mps <= GAME.target_greatest_mps
    x, y = legs[-1].end
    assert min(abs(x + 1), abs(x - 3), abs(y - 2), abs(y - 8)) < 1e-8


def test_headings_speeds_and_times_are_uniform() -> None:
    legs = [way(seed) for seed in range(PATHS)]

    aside = [leg.off_rad / pi for path in legs for leg in path[1:]]
    speeds = [(path[0].speed_mps - 0.3) / 0.4 - 0.5 for path in legs]
    times = [(leg.lasts_ns * 1e-9 - 2.0) / 3.0 - 0.5 for path in legs for leg in path[:-1]]
    for shares in (aside, speeds):                  # uniform in [-0.5, 0.5]: mean 0, variance 1 / 12
        n = len(shares)
        assert abs(sum(shares) / n) < 4 * sqrt(1 / 12 / n)
        assert abs(sum(share ** 2 for share in shares) / n - 1 / 12) < 4 * sqrt((1 / 80 - 1 / 144) / n)
    assert min(times) >= -0.5                       # the mean of legs that end in a turn is less: long ones leave
    assert max(times) <= 0.5

    inward = [path[0].velocity_mps[0] * cos(a) + path[0].velocity_mps[1] * sin(a)
              for path in legs for a in [inward_of(path[0].place)]]
    assert min(inward) >= 0.0
    mean = sum(v / path[0].speed_mps for v, path in zip(inward, legs, strict=True)) / PATHS
    assert abs(mean - 2 / pi) < 4 * sqrt((0.5 - 4 / pi ** 2) / PATHS)       # mean of cos, uniform within +-pi/2


def inward_of(place: tuple[float, float]) -> float:
    x, y = place
    return min((hypot(x + 1), 0.0), (hypot(x - 3), pi), (hypot(y - 2), pi / 2), (hypot(y - 8), -pi / 2))[1]


BOX: Polygon = ((0.5, 4.0), (2.0, 4.0), (2.0, 6.0), (0.5, 6.0))
WEDGE: tuple[Polygon, ...] = (((-1.0, 7.0), (0.0, 7.5), (0.0, 7.7), (-1.0, 7.2)), ((0.0, 7.5), (1.5, 6.0), (1.6, 6.1),
                                                                                 (0.1, 7.6)))
LAYOUTS = [(BOX,), (((-1.0, 4.0), (1.0, 5.0), (-1.0, 6.0)), BOX), WEDGE]


@pytest.mark.parametrize("obstacles", LAYOUTS, ids=["a box", "at the wall, and a gap", "a wedge"])
@pytest.mark.parametrize("seed", range(60))
def test_no_leg_passes_through_an_obstacle(seed: int, obstacles: Sequence[Polygon]) -> None:
    legs = way(seed, obstacles)

    solid = [shapely.Polygon(corners).buffer(-1e-6) for corners in obstacles]
    assert not any(each.intersects(shapely.Point(legs[0].place)) for each in solid)
    for leg in legs:
        assert not any(each.intersects(shapely.LineString([leg.place, leg.end])) for each in solid)
        assert (leg.ending is Ending.AVOIDS) <= any(
            shapely.Polygon(corners).exterior.distance(shapely.Point(leg.end)) < 1e-6 for corners in obstacles)
        assert leg.speed_mps == legs[0].speed_mps


def test_a_target_turns_away_from_an_obstacle_and_goes_on_if_it_can() -> None:
    avoided, forward = 0, 0
    for seed in range(200):
        in_a_row = 0
        for one, later in pairwise(way(seed, LAYOUTS[1], most=20)):
            in_a_row = in_a_row + 1 if one.ending is Ending.AVOIDS else 0
            if in_a_row == 0 or in_a_row % TRAPPED == 0:
                continue
            avoided += 1
            forward += abs(later.off_rad) < 0.5 * pi
            free = [off for off in (pi * k / 36 + pi / 72 for k in range(-18, 18)) if free_m(
                one.end, later.heading_rad - later.off_rad + off) >= GAME.platform_m]
            assert (abs(later.off_rad) < 0.5 * pi) == bool(free)
            assert later.ending is not Ending.AVOIDS or later.lasts_ns >= int(
                GAME.platform_m / GAME.target_greatest_mps * 1e9)           # no two turns at obstacles in no time
            assert later.ending is not Ending.TURNS or later.lasts_ns >= GAME.turn_least_ns
    assert avoided > 100
    assert 0.5 * avoided < forward < avoided            # both cases occur


def free_m(place: tuple[float, float], heading_rad: float) -> float:
    """How far a ray comes, by Shapely, from 0.1 mm ahead on."""
    x, y = (at + 1e-4 * f(heading_rad) for at, f in zip(place, (cos, sin), strict=True))
    ray = shapely.LineString([(x, y), (x + 20 * cos(heading_rad), y + 20 * sin(heading_rad))])
    hits = [shapely.Polygon(corners).intersection(ray) for corners in LAYOUTS[1]]
    return min((shapely.Point(x, y).distance(hit) for hit in hits if not hit.is_empty), default=20.0)


def test_entrances_inside_an_obstacle_are_redrawn() -> None:
    south = ((-1.0, 2.0), (3.0, 2.0), (3.0, 3.0), (-1.0, 3.0))              # the whole south wall, 6 of 20 m

    shares = [TargetPath(AREA, GAME, Random(seed), [south]).leg.place for seed in range(1000)]

    assert min(y for _, y in shares) >= 3.0
    north = sum(y == 8.0 for _, y in shares) / 1000
    assert abs(north - 4 / 14) < 4 * sqrt(4 / 14 * 10 / 14 / 1000)          # uniform on the 14 m that are left


def test_a_target_that_meets_a_wall_head_on_goes_along_it() -> None:
    wall = ((1.0, 2.0), (1.2, 2.0), (1.2, 8.0), (1.0, 8.0))                 # from south to north
    path = next(path for path in (TargetPath(AREA, GAME, Random(seed), [wall]) for seed in range(20_000))
                if path.leg.ending is Ending.AVOIDS and path.leg.place[0] == -1.0 and abs(path.leg.heading_rad) < 0.04)

    along = path.turn()

    assert abs(along.off_rad) == pytest.approx(0.5 * pi + pi / 72)          # 2.5 degrees beyond the half plane
    assert along.end[0] < 1.0


def test_a_corner_that_is_open_backwards_only_does_not_hold_a_target() -> None:
    lengths = [len(way(seed, LAYOUTS[1], most=2000)) for seed in range(60)]

    assert max(lengths) < 2000
