import numpy as np
import pytest

from agents.optimal_triggering.averager import Grid, NearestNeighbours, symmetric, values

GRID = Grid(symmetric(1.0, 3.0), symmetric(2.0), symmetric(0.5, 1.0))
NEAREST = NearestNeighbours(GRID.points, 3, (3.0, 2.0, 1.0))


@pytest.mark.parametrize("averager", [GRID, NEAREST], ids=["grid", "nearest"])
def test_weights_are_those_of_an_average(averager):
    x = np.random.default_rng(0).uniform(-4, 4, (3, 200))       # also outside of the points

    found = averager.combine(x)

    assert (found.weights >= 0).all()
    assert found.weights.sum(axis=0) == pytest.approx(1.0)
    assert found.points.min() >= 0
    assert found.points.max() < averager.points.shape[1]


@pytest.mark.parametrize("averager", [GRID, NEAREST], ids=["grid", "nearest"])
def test_a_point_has_its_own_value(averager):
    at_points = np.random.default_rng(1).normal(size=averager.points.shape[1])

    assert values(averager, at_points, averager.points) == pytest.approx(at_points, abs=1e-9)


def test_a_grid_reproduces_linear_functions_and_clamps():
    at_points = np.array([1.0, -2.0, 3.0]) @ GRID.points + 5
    x = np.array([[0.3, 9.0], [-1.2, 0.0], [0.9, 0.0]])

    assert values(GRID, at_points, x) == pytest.approx([0.3 + 2.4 + 2.7 + 5, 3.0 + 5])


def test_an_axis_that_does_not_ascend_is_refused():
    with pytest.raises(ValueError, match="each larger"):
        Grid(np.array([0.0, 0.0]), symmetric(1.0), symmetric(1.0))
