"""C-targets and P_R: the figures of the specification, and the two monotonicities that one epsilon mixes up."""

from itertools import pairwise
from math import asin, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from shapely import box
from shapely.geometry import Polygon

from agents.marco_polo.c_target import CTarget
from agents.marco_polo.cells import Cells
from agents.marco_polo.detection_probability import detection_probability, observation_cells
from agents.marco_polo.track_line import fit_track
from tests.agents.marco_polo.layouts import AREA, OBSTACLE

TRACK = fit_track([(1.0, 1.0), (2.0, 1.8)])
CELLS = Cells(AREA, 0.5)
EVERYWHERE = CELLS.free([], 0.5)


@pytest.mark.parametrize(("content", "alpha"), [(0.2, 3.0777), (0.3, 1.9626), (0.5, 1.0), (0.8, 0.3249)])
def test_the_slope_of_the_boundary(content, alpha):
    assert CTarget(TRACK, 1.25, content).slope == pytest.approx(alpha, abs=1e-4)


def test_the_area_of_the_c_target():
    target = CTarget(TRACK, 1.25, 0.5)

    assert target.area_m2(AREA) == pytest.approx(72.446, abs=0.1)
    assert Polygon(target.outline(AREA)).area == pytest.approx(target.area_m2(AREA), rel=1e-12)
    assert Polygon(target.outline(AREA)).exterior.is_ccw
    x, y = np.random.default_rng(2).uniform(0.0, 10.0, (2, 200_000))
    share = float(np.mean(target.contains(np.stack([x, y], axis=1))))
    assert abs(100.0 * share - target.area_m2(AREA)) <= 3.0 * 100.0 * sqrt(share * (1.0 - share) / 200_000)


@settings(deadline=None)
@given(st.tuples(st.floats(0.0, 10.0), st.floats(0.0, 10.0)), st.floats(-3.1, 3.1), st.floats(0.05, 0.95))
def test_corners_of_the_outline_lie_on_the_boundary_of_the_cone_or_of_the_area(start, heading, content):
    track = fit_track([(start[0] - np.cos(heading), start[1] - np.sin(heading)), start])
    target = CTarget(track, 1.25, content)

    outline = target.outline(AREA)

    for corner in outline:
        along, across = (float(value) for value in target.along_and_across_m(corner))
        slack = min(abs(along), abs(abs(across) - target.half_width_m(along)))
        wall = min(abs(value - side) for value in corner for side in (0.0, 10.0))
        assert min(slack, wall) < 1e-6
        assert along <= target.depth_m(AREA) + 1e-9
    assert target.place(*(float(value) for value in target.along_and_across_m(start))) == pytest.approx(start, abs=1e-9)


def test_a_larger_content_makes_the_cone_larger_and_a_larger_threshold_the_observation_cells_fewer():
    contents = [0.1, 0.2, 0.3, 0.5, 0.8]
    cones = [Polygon(CTarget(TRACK, 1.25, content).outline(AREA)) for content in contents]
    thresholds = [0.1, 0.2, 0.3, 0.5, 0.8]
    regions = [set(observation_cells(CELLS, EVERYWHERE, TRACK, 1.25, threshold).tolist()) for threshold in thresholds]

    for smaller, larger in pairwise(cones):
        assert larger.buffer(1e-9).covers(smaller)
        assert larger.area > smaller.area + 0.1
    for larger_set, smaller_set in pairwise(regions):
        assert smaller_set < larger_set


def test_the_share_of_positions_inside_after_legs_is_not_the_content_of_the_cone():
    generator, targets = np.random.default_rng(3), 100_000
    target = CTarget(fit_track([(0.0, 0.0), (1.0, 0.0)]), 1.25, 0.3)
    headings = generator.uniform(-pi / 2, pi / 2, (10, targets))
    along, across = np.cumsum(np.cos(headings), axis=0), np.cumsum(np.sin(headings), axis=0)

    for legs, expected in ((1, 0.5191), (3, 0.6889), (10, 0.8777)):
        share = float(np.mean(target.contains(np.stack([1.0 + along[legs - 1], across[legs - 1]], axis=1))))
        assert abs(share - expected) <= 3.0 * sqrt(expected * (1.0 - expected) / targets) + 5e-5


def test_the_share_after_one_leg_is_where_the_circle_of_the_leg_crosses_the_boundary():
    target = CTarget(fit_track([(0.0, 0.0), (1.0, 0.0)]), 1.25, 0.3)
    crossing = brentq(lambda heading: np.sin(heading) - target.half_width_m(np.cos(heading)), 0.0, pi / 2)
    headings = ((np.arange(100_000) + 0.5) / 100_000 - 0.5) * pi

    share = float(np.mean(target.contains(np.stack([1.0 + np.cos(headings), np.sin(headings)], axis=1))))

    assert share == pytest.approx(2.0 * crossing / pi, abs=1e-4)
    assert share == pytest.approx(0.5169, abs=1e-4)


@pytest.mark.parametrize("content", [0.0, 1.0, -0.3, float("nan")])
def test_a_content_that_is_no_probability_is_refused(content):
    with pytest.raises(ValueError, match="cone_content"):
        CTarget(TRACK, 1.25, content)


def test_a_cone_that_lies_outside_has_no_outline():
    target = CTarget(fit_track([(9.0, 5.0), (11.0, 5.0)]), 0.5, 0.3)

    assert target.outline(AREA) == []
    assert target.depth_m(AREA) == 0.0
    assert target.area_m2(AREA) == 0.0


def test_the_probability_of_detection_at_the_place_of_the_specification():
    found = detection_probability(AREA, TRACK, [(5.25, 4.25)], 1.25)

    assert found[0] == pytest.approx(0.1987, abs=1e-4)
    distance = np.hypot(5.25 - 2.0, 4.25 - 1.8)
    assert found[0] == pytest.approx(2.0 * asin(1.25 / distance) / pi, abs=1e-12)


def test_monte_carlo_of_straight_tracks_agrees_within_three_standard_errors():
    generator, tracks = np.random.default_rng(4), 100_000
    heading = TRACK.heading_rad + generator.uniform(-pi / 2, pi / 2, tracks)
    ux, uy = np.cos(heading), np.sin(heading)
    places = np.array([(5.25, 4.25), (2.5, 1.0), (1.5, 2.5), (9.9, 0.3), (0.2, 9.0), (1.0, 0.5)])

    found = detection_probability(AREA, TRACK, places, 1.25)

    x0, y0 = TRACK.last
    with np.errstate(divide="ignore"):
        length = np.minimum(np.where(ux > 0, (10.0 - x0) / ux, -x0 / ux), np.where(uy > 0, (10.0 - y0) / uy, -y0 / uy))
    for (x, y), probability in zip(places, found, strict=True):
        foot = np.clip((x - x0) * ux + (y - y0) * uy, 0.0, length)
        share = float(np.mean(np.hypot(x0 + foot * ux - x, y0 + foot * uy - y) <= 1.25))
        assert abs(share - probability) <= 3.0 * sqrt(max(probability * (1 - probability), 1 / tracks) / tracks)


def test_the_number_of_observation_cells():
    assert len(observation_cells(CELLS, EVERYWHERE, TRACK, 1.25, 0.3)) == 52


def test_observation_cells_are_free():
    free = CELLS.free([OBSTACLE], 0.5)

    found = observation_cells(CELLS, free, TRACK, 1.25, 0.1)

    assert 0 < len(found) < len(observation_cells(CELLS, EVERYWHERE, TRACK, 1.25, 0.1))
    assert free[found].all()
    inside = [box(*OBSTACLE[0], *OBSTACLE[2]).covers(box(x, y, x, y)) for x, y in CELLS.centroids_m[found]]
    assert not any(inside)


@pytest.mark.parametrize("threshold", [-0.1, 1.0, float("nan")])
def test_a_threshold_that_no_cell_or_every_cell_passes_is_refused(threshold):
    with pytest.raises(ValueError, match="detection_threshold"):
        observation_cells(CELLS, EVERYWHERE, TRACK, 1.25, threshold)
