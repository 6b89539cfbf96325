"""Intervals of headings, compared with rays that Shapely intersects with clipped discs."""

from math import asin, cos, hypot, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, Point, box

from agents.marco_polo.sight import HALF_PI, boundary, fields_of_view, seen
from agents.pursuit.law import Area
from tests.agents.marco_polo.layouts import AREA
from tests.examples import examples

FACETS = 256                    # sides of a quarter of the oracle's polygons, one inside the disc and one around it


def seen_of(origin, axis, centre, radius, area=AREA):
    low, high = seen(area, np.array([origin], dtype=float), np.array([axis]), np.array([centre], dtype=float),
                     np.array([radius]))
    return float(low[0, 0]), float(high[0, 0])


def test_a_disc_inside_the_area_is_seen_under_its_tangents():
    low, high = seen_of((0.0, 5.0), 0.0, (3.0, 6.0), 1.0)

    middle, half = np.arctan2(1.0, 3.0), asin(1.0 / hypot(3.0, 1.0))
    assert (low, high) == pytest.approx((middle - half, middle + half), abs=1e-12)


def test_half_a_disc_on_a_wall_is_seen_from_its_corner_to_a_tangent():
    low, high = seen_of((10.0, 0.0), pi, (0.0, 5.0), 1.0)

    tangent = -np.arctan(0.5) - asin(1.0 / hypot(10.0, 5.0))
    assert (low, high) == pytest.approx((tangent, -np.arctan(0.4)), abs=1e-12)      # (0, 4) is the corner


def test_an_origin_inside_a_field_of_view_sees_it_under_all_headings():
    assert seen_of((0.0, 5.0), 0.0, (0.5, 5.0), 1.0) == (-HALF_PI, HALF_PI)


@pytest.mark.parametrize("centre", [(5.0, 12.0), (-2.0, -2.0), (2.0, 5.0)])
def test_what_lies_outside_the_area_or_behind_the_axis_is_not_seen(centre):
    low, high = seen_of((5.0, 5.0), 0.0, centre, 1.5)

    assert low == high


place = st.tuples(st.floats(0.0, 10.0), st.floats(0.0, 10.0))
around = st.tuples(st.floats(-3.0, 13.0), st.floats(-3.0, 13.0))


@settings(max_examples=examples(300), deadline=None)
@given(place, st.floats(-7.0, 7.0), around, st.floats(0.2, 6.0), st.lists(st.floats(-1.57, 1.57), max_size=4))
def test_a_ray_meets_the_part_inside_the_area_exactly_within_the_interval(origin, axis, centre, radius, headings):
    low, high = seen_of(origin, axis, centre, radius)

    inner, outer = (Point(centre).buffer(r, quad_segs=FACETS).intersection(box(0, 0, 10, 10))
                    for r in (radius, radius / cos(pi / (4 * FACETS))))
    for heading in headings:
        ray = LineString([origin, (origin[0] + 40 * cos(axis + heading), origin[1] + 40 * sin(axis + heading))])
        if ray.intersects(inner):
            assert low - 1e-9 <= heading <= high + 1e-9
        elif not ray.intersects(outer):
            assert not low + 1e-9 < heading < high - 1e-9


@pytest.mark.parametrize("cells", [4, 40, 200, 333])
def test_the_boundary_is_divided_into_cells_whose_weights_sum_to_one(cells):
    edge = boundary(Area((1.0, 5.0), (-2.0, 10.0)), cells)

    x, y = edge.places_m.T
    assert abs(len(edge.weights) - cells) <= 4
    assert float(edge.weights.sum()) == pytest.approx(1.0, abs=1e-12)
    assert np.all(np.isclose(x, 1.0) | np.isclose(x, 5.0) | np.isclose(y, -2.0) | np.isclose(y, 10.0))
    inward = edge.places_m + 1e-6 * np.stack([np.cos(edge.axes_rad), np.sin(edge.axes_rad)], axis=1)
    assert np.all((inward > [1.0, -2.0]).all(axis=1) & (inward < [5.0, 10.0]).all(axis=1))


@pytest.mark.parametrize(("centres", "radii"), [([[1.0, np.nan]], 1.0), ([[1.0, 1.0]], 0.0), ([[1.0, 1.0]], -1.0),
                                                ([[1.0, 1.0]], np.inf)])
def test_fields_of_view_that_are_none_are_refused(centres, radii):
    with pytest.raises(ValueError, match="expected"):
        fields_of_view(centres, radii)


def test_a_boundary_of_fewer_cells_than_walls_is_refused():
    with pytest.raises(ValueError, match="at least 4"):
        boundary(AREA, 3)
