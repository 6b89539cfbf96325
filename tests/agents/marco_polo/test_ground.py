"""Ways of a platform among obstacles: what it sweeps is compared with them by Shapely."""

from __future__ import annotations

from itertools import pairwise

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from agents.marco_polo.cells import Cells, square
from agents.marco_polo.ground import Ground
from tests.agents.marco_polo.layouts import AREA, OBSTACLE, ZONE
from tests.examples import examples

CELLS = Cells(AREA, 0.5)
PLATFORM_M = 0.5
SMALL = ((1.2, 1.3), (1.9, 1.1), (1.6, 2.2))
PLACES = st.tuples(st.floats(0.25, 9.75), st.floats(0.25, 9.75))


def overlap_m2(start: tuple[float, float], end: tuple[float, float], barrier: object) -> float:
    """What the platform overlaps of a barrier at most, in squares every cm of the leg."""
    steps = 1 + int(shapely.LineString([start, end]).length / 0.01)
    places = [(start[0] + (end[0] - start[0]) * k / steps, start[1] + (end[1] - start[1]) * k / steps)
              for k in range(steps + 1)]
    squares = shapely.polygons([square(place, PLATFORM_M) for place in places])
    return float(shapely.area(shapely.intersection(squares, shapely.Polygon(barrier))).max())


@settings(max_examples=examples(50))
@given(start=PLACES, end=PLACES)
def test_a_leg_is_clear_if_the_platform_overlaps_nothing_on_it(start: tuple[float, float],
                                                               end: tuple[float, float]) -> None:
    most_m2 = max(overlap_m2(start, end, barrier) for barrier in (OBSTACLE, SMALL))

    clear = Ground(CELLS, [OBSTACLE, SMALL], PLATFORM_M).clear(start, end)

    if clear:
        assert most_m2 < 1e-6
    elif most_m2 == 0.0:        # the squares between two samples may touch what theirs do not
        hull = shapely.MultiPoint([*square(start, PLATFORM_M), *square(end, PLATFORM_M)]).convex_hull
        assert any(hull.intersection(shapely.Polygon(barrier)).area < 1e-2 for barrier in (OBSTACLE, SMALL))


@settings(max_examples=examples(50))
@given(start=PLACES, goal=PLACES)
def test_ways_among_obstacles_are_clear(start: tuple[float, float], goal: tuple[float, float]) -> None:
    ground = Ground(CELLS, [OBSTACLE, ZONE, SMALL], PLATFORM_M)
    if not ground.clear(start, start):
        return

    way = ground.way(ground.graph(), start, goal)

    for leg in pairwise([start, *way]):
        assert max(overlap_m2(*leg, barrier) for barrier in (OBSTACLE, ZONE, SMALL)) < 1e-6


def test_the_grid_is_entered_round_a_corner_that_is_in_the_way() -> None:
    """The platform touches a box whose corner is between it and the middle of its own cell."""
    place, box = (5.0, 5.0), ((4.0, 5.3), (4.95, 5.3), (4.95, 6.0), (4.0, 6.0))
    ground = Ground(CELLS, [box], PLATFORM_M)
    graph = ground.graph()
    inner = CELLS.centroid(CELLS.cell_at(place))
    assert inner == (5.25, 5.25)
    assert graph.free[CELLS.cell_at(place)]
    assert not ground.clear(place, inner)

    entry = ground.entry(graph, place)

    assert entry is not None
    assert ground.clear(place, CELLS.centroid(entry))


def test_without_barriers_everything_is_clear_and_a_way_starts_with_the_second_cell() -> None:
    ground = Ground(CELLS, [], PLATFORM_M)

    assert ground.clear((-1.0, 0.0), (20.0, 3.0))
    assert ground.way(ground.graph(), (0.3, 0.3), (1.3, 0.3)) == [(0.75, 0.25), (1.25, 0.25)]
    assert ground.way(ground.graph([(0.75, 0.25)]), (0.3, 0.3), (1.3, 0.3))[0] == (0.25, 0.75)


@pytest.mark.parametrize("slack_m", [0.0, 1e-6])
def test_slack_lets_rounding_pass(slack_m: float) -> None:
    ground = Ground(CELLS, [OBSTACLE], PLATFORM_M)
    touching = (2.75 + 1e-8, 5.0)

    assert ground.clear(touching, touching, slack_m=slack_m) is (slack_m > 0.0)
