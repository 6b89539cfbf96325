"""The way of a target: where it enters, how it turns, where it leaves; distributions against section 2.4."""

from __future__ import annotations

from itertools import pairwise
from math import cos, hypot, pi, sin, sqrt
from random import Random

import pytest

from agents.marco_polo.game_parameters import GameParameters
from agents.marco_polo_game.target_path import Leg, TargetPath, entrance
from agents.pursuit.law import Area

AREA = Area((-1.0, 3.0), (2.0, 8.0))         # 4 x 6 m, so that sides cannot be confused
GAME = GameParameters()
PATHS = 2000


def way(seed: int) -> list[Leg]:
    path = TargetPath(AREA, GAME, Random(seed))
    legs = [path.leg]
    while not legs[-1].leaves:
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
        assert leg.leaves or leg.lasts_ns >= GAME.turn_least_ns
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
    times = [(leg.lasts_ns * 1e-9 - 2.0) / 3.0 - 0.5 for path in legs for leg in path[:-1] if not leg.leaves]
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
