"""Depth inside a convex polygon, and ways until it is entered, against Shapely."""

from __future__ import annotations

from math import cos, hypot, inf, pi, sin

import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from agents.marco_polo.convex_polygon import ConvexPolygon

TRIANGLE = ((1.0, 1.0), (4.0, 2.0), (2.0, 5.0))
PLACES = st.tuples(st.floats(-2.0, 7.0), st.floats(-2.0, 7.0))
FAR = 50.0


@pytest.mark.parametrize("corners", [TRIANGLE, TRIANGLE[::-1]], ids=["counterclockwise", "clockwise"])
@given(place=PLACES)
def test_depth_is_the_distance_to_the_nearest_edge(corners: tuple[tuple[float, float], ...],
                                                   place: tuple[float, float]) -> None:
    oracle, point = shapely.Polygon(corners), shapely.Point(place)

    depth_m = ConvexPolygon(corners).depth_m(place)

    if oracle.contains(point):
        assert depth_m == pytest.approx(oracle.exterior.distance(point), abs=1e-9)
    else:
        assert -oracle.distance(point) - 1e-9 <= depth_m <= 1e-9


@given(place=PLACES, heading_rad=st.floats(-pi, pi))
def test_the_way_ends_where_the_ray_enters(place: tuple[float, float], heading_rad: float) -> None:
    oracle = shapely.Polygon(TRIANGLE)
    assume(not oracle.buffer(1e-3).contains(shapely.Point(place)))
    ray = shapely.LineString([place, (place[0] + FAR * cos(heading_rad), place[1] + FAR * sin(heading_rad))])
    inside = ray.intersection(oracle)
    assume(inside.is_empty or inside.length > 1e-5)         # a ray that grazes a corner is a matter of rounding

    way_m = ConvexPolygon(TRIANGLE).way_m(place, heading_rad)

    if inside.is_empty:
        assert way_m == inf
    else:
        assert way_m == pytest.approx(min(hypot(x - place[0], y - place[1]) for x, y in inside.coords), abs=1e-6)


@pytest.mark.parametrize(("heading_deg", "way_m"), [
    (90.0, inf), (170.0, inf), (5.0, inf),                  # away from the edge
    (-1.0, 0.0), (-90.0, 0.0), (-179.0, 0.0)])              # inwards
def test_from_an_edge_only_headings_that_lead_away_are_free(heading_deg: float, way_m: float) -> None:
    box = ConvexPolygon(((1.0, 1.0), (3.0, 1.0), (3.0, 2.0), (1.0, 2.0)))

    for y in (2.0, 2.0 - 1e-8):                             # rounding may leave a point a little inside
        assert box.way_m((2.0, y), heading_deg * pi / 180.0) == way_m
