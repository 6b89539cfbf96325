"""Free cells, and A* against SciPy's Dijkstra on a graph that the test builds by itself."""

from math import inf, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from shapely import box
from shapely.geometry import Polygon

from agents.marco_polo.cells import Cells, square
from agents.marco_polo.connectivity import ConnectivityGraph
from agents.pursuit.law import Area
from tests.agents.marco_polo.layouts import AREA, OBSTACLE, ZONE
from tests.examples import examples

CELLS = Cells(AREA, 0.5)
FIRST, LAST = 0, 399            # cells of opposite corners


def graph(*obstacles):
    return ConnectivityGraph(CELLS, CELLS.free(obstacles, 0.5))


def lengths(free, rows, columns, side, start):
    """SciPy's Dijkstra over moves to 8 neighbours; a diagonal one needs the two cells beside it."""
    grid = free.reshape(rows, columns)
    weights = np.zeros((rows * columns, rows * columns))
    for row in range(rows):
        for column in range(columns):
            for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
                to_row, to_column = row + down, column + right
                if not (0 <= to_row < rows and 0 <= to_column < columns):
                    continue
                if grid[row, column] and grid[to_row, to_column] and grid[row, to_column] and grid[to_row, column]:
                    weights[row * columns + column, to_row * columns + to_column] = side * sqrt(down ** 2 + right ** 2)
    return dijkstra(csr_array(weights), directed=False, indices=start)


@pytest.mark.parametrize(("obstacles", "count"), [((), 400), ((OBSTACLE,), 336), ((OBSTACLE, ZONE), 304)])
def test_the_number_of_free_cells(obstacles, count):
    assert int(CELLS.free(obstacles, 0.5).sum()) == count


@pytest.mark.parametrize(("obstacles", "length"), [((), 13.4350), ((OBSTACLE,), 16.0711)])
def test_the_shortest_route_from_corner_to_corner(obstacles, length):
    assert graph(*obstacles).route(FIRST, LAST).length_m == pytest.approx(length, abs=1e-4)


def test_a_zone_makes_the_route_along_x_8_longer():
    start, goal = CELLS.cell_at((8.0, 1.2)), CELLS.cell_at((8.0, 8.0))

    assert graph().route(start, goal).length_m == pytest.approx(7.0, abs=1e-4)
    assert graph(ZONE).route(start, goal).length_m == pytest.approx(8.1213, abs=1e-4)


free_cells = st.lists(st.booleans(), min_size=48, max_size=48).map(np.array)


@settings(max_examples=examples(150), deadline=None)
@given(free_cells, st.integers(0, 47), st.integers(0, 47))
def test_routes_are_as_short_as_scipys_and_stay_in_free_cells(free, start, goal):
    cells = Cells(Area((0.0, 4.0), (0.0, 3.0)), 0.5)

    route = ConnectivityGraph(cells, free).route(start, goal)

    least = lengths(free, 6, 8, 0.5, start)[goal] if free[start] else inf
    if least == inf:
        assert route is None
        return
    assert route.length_m == pytest.approx(least, abs=1e-9)
    assert (route.cells[0], route.cells[-1]) == (start, goal)
    assert free[route.cells].all()
    walked = np.diff(cells.centroids_m[route.cells], axis=0)
    assert float(np.sum(np.hypot(*walked.T))) == pytest.approx(route.length_m)
    assert np.all(np.abs(walked) <= 0.5 + 1e-9)


gains = st.dictionaries(st.integers(0, 47), st.floats(-3.0, 3.0), max_size=12)


@settings(max_examples=examples(150), deadline=None)
@given(free_cells, st.integers(0, 47), gains, st.floats(0.01, 2.0))
def test_the_best_route_has_the_greatest_gain_less_cost_over_all_goals(free, start, gains, cost):
    made = ConnectivityGraph(Cells(Area((0.0, 4.0), (0.0, 3.0)), 0.5), free)

    route = made.best_route(start, gains, cost)

    least = lengths(free, 6, 8, 0.5, start)
    values = [gain - cost * least[goal] for goal, gain in gains.items()
              if free[start] and free[goal] and least[goal] < inf]
    if not values:
        assert route is None
        return
    assert gains[route.cells[-1]] - cost * route.length_m == pytest.approx(max(values), abs=1e-9)
    assert made.best_route(start, gains, cost) == route             # nothing of the search stays in the graph


@settings(deadline=None)
@given(free_cells, st.integers(0, 47))
def test_reachable_cells_are_those_at_a_finite_distance(free, start):
    made = ConnectivityGraph(Cells(Area((0.0, 4.0), (0.0, 3.0)), 0.5), free)

    expected = np.isfinite(lengths(free, 6, 8, 0.5, start)) & free[start]

    assert (made.reachable(start) == expected).all()


@settings(deadline=None)
@given(st.lists(st.tuples(st.floats(0.5, 9.5), st.floats(0.5, 9.5)), min_size=3, max_size=6), st.floats(0.05, 1.5))
def test_a_platform_overlaps_no_obstacle_exactly_in_free_cells(corners, platform):
    hull = Polygon(corners).convex_hull
    if hull.geom_type != "Polygon" or hull.area < 1e-3:
        return

    free = CELLS.free([list(hull.exterior.coords)[:-1]], platform)

    half = platform / 2
    for (x, y), is_free in zip(CELLS.centroids_m, free, strict=True):
        overlap = box(x - half, y - half, x + half, y + half).intersection(hull).area
        inside = half <= x + 1e-9 <= 10.0 - half + 2e-9 and half <= y + 1e-9 <= 10.0 - half + 2e-9
        if overlap > 1e-6 or not inside:
            assert not is_free
        elif overlap == 0.0 and box(x - half, y - half, x + half, y + half).distance(hull) > 1e-9:
            assert is_free


def test_platforms_of_others_are_obstacles_and_touching_is_allowed():
    other = square((5.25, 5.25), 0.5)

    assert int((~CELLS.free([other], 0.5)).sum()) == 1
    assert int((~CELLS.free([square((5.0, 5.0), 0.5)], 0.5)).sum()) == 4


def test_cells_contain_their_centroids_and_places_outside_count_as_the_nearest_inside():
    assert [CELLS.cell_at(CELLS.centroid(cell)) for cell in range(400)] == list(range(400))
    assert CELLS.cell_at((-3.0, 12.0)) == 380
    assert CELLS.cell_at((10.0, 10.0)) == LAST
    with pytest.raises(ValueError, match="finite"):
        CELLS.cell_at((float("nan"), 1.0))


def test_the_nearest_free_cell():
    made = graph(OBSTACLE)

    assert made.nearest((5.0, 2.9)) == CELLS.cell_at((4.9, 2.9))
    assert made.nearest((1.0, 1.0), np.zeros(400, dtype=bool)) is None


@pytest.mark.parametrize(("side", "why"), [(0.3, "0.303030303 m gives 33"), (0.0, "more than 0"), (inf, "more than 0")])
def test_cells_that_do_not_fill_the_area_are_refused(side, why):
    with pytest.raises(ValueError, match=why):
        Cells(AREA, side)


def test_a_route_without_cost_and_cells_of_another_size_are_refused():
    with pytest.raises(ValueError, match="cost_per_m=0"):
        graph().best_route(FIRST, {LAST: 1.0}, 0.0)
    with pytest.raises(ValueError, match="shape"):
        ConnectivityGraph(CELLS, np.ones(10, dtype=bool))
