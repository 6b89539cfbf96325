"""Placement: its gradient, a case that a grid decides, and the figures of the specification."""

from itertools import combinations

import numpy as np
import pytest

from agents.marco_polo.placement import place_sensors
from agents.marco_polo.track_coverage import Headings, track_coverage
from tests.agents.marco_polo.layouts import AREA, RADII


def test_one_sensor_is_placed_as_well_as_on_the_finest_grid():
    found = place_sensors(AREA, [1.5], 1, 0.0, np.random.default_rng(1), hops=30)

    grid = np.linspace(0.25, 5.0, 20)       # the area is a square: one of its eight triangles has what the others have
    best = max(track_coverage(AREA, [(x, y)], [1.5], boundary_cells=800)[0] for x in grid for y in grid if y <= x)
    assert found.track_coverage >= best - 1e-3


def test_under_isotropic_lines_one_place_is_as_good_as_any_inside():
    found = place_sensors(AREA, [1.5], 1, 0.07, np.random.default_rng(1), headings=Headings.ISOTROPIC, hops=2)

    assert found.track_coverage == pytest.approx(2 * np.pi * 1.5 / 40.0, abs=1e-3)
    assert found.area_coverage >= 0.07


def test_the_same_generator_gives_the_same_placement_and_platforms_keep_apart():
    first, second = (place_sensors(AREA, [1.5, 1.0, 1.0], 2, 0.1, np.random.default_rng(7), hops=3) for _ in range(2))

    assert (first.centres_m == second.centres_m).all()
    assert first.area_coverage >= 0.1
    assert np.all((first.centres_m >= 0.25) & (first.centres_m <= 9.75))
    for one, other in combinations(first.centres_m, 2):
        assert np.max(np.abs(one - other)) >= 0.5 - 1e-6


@pytest.mark.slow
@pytest.mark.parametrize(("least_area", "expected", "hops"), [(0.0, 0.30, 200), (0.25, 0.28, 50), (0.30, 0.25, 50),
                                                              (0.33, 0.215, 50)])
def test_the_placement_of_the_team_reaches_the_figures_of_the_specification(least_area, expected, hops):
    found = place_sensors(AREA, RADII, 3, least_area, np.random.default_rng(1), hops=hops)

    assert found.track_coverage >= expected
    assert found.area_coverage >= least_area
    assert track_coverage(AREA, found.centres_m, RADII, boundary_cells=3200)[2] == pytest.approx(found.track_coverage,
                                                                                                 abs=1e-4)


@pytest.mark.parametrize(("arguments", "why"), [(([1.0, 1.0], 3, 0.0), "k=3"), (([1.0, 1.0], 0, 0.0), "k=0"),
                                                (([1.0, 1.0], 2, 0.07), "at most 0.0628"),
                                                (([1.0], 1, -0.1), "at most")])
def test_a_placement_that_cannot_be_is_refused(arguments, why):
    with pytest.raises(ValueError, match=why):
        place_sensors(AREA, *arguments, np.random.default_rng(1))


def test_a_platform_wider_than_the_area_is_refused():
    with pytest.raises(ValueError, match="platform_m=10"):
        place_sensors(AREA, [1.0], 1, 0.0, np.random.default_rng(1), platform_m=10.0)
