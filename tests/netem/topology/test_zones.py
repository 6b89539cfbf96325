from math import cos, dist, hypot, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netem.topology.zones import Circle, Rectangle

WALL = Rectangle("rectangle", (4.0, -1.0), (5.0, 1.0), 20.0, "path")
TANK = Circle("circle", (4.0, 3.0), 2.0, 20.0, "path")
place = st.tuples(*[st.integers(-100, 100).map(lambda tenths: tenths / 10)] * 2)


@pytest.mark.parametrize(("zone", "one", "other", "weak"), [
    (WALL, (0.0, 0.0), (9.0, 0.0), True),
    (WALL, (0.0, 0.0), (9.0, 5.0), False),
    (WALL, (0.0, 0.0), (4.0, 0.0), True),           # ends on the edge
    (WALL, (0.0, 0.0), (3.9, 0.0), False),
    (WALL, (4.5, -9.0), (4.5, 9.0), True),          # parallel to two edges
    (WALL, (5.1, -9.0), (5.1, 9.0), False),
    (WALL, (3.0, 1.0), (6.0, 1.0), True),           # along an edge
    (TANK, (0.0, 3.0), (9.0, 3.0), True),
    (TANK, (0.0, 5.0), (9.0, 5.0), True),           # touches
    (TANK, (0.0, 5.1), (9.0, 5.1), False),
    (TANK, (-9.0, 3.0), (1.9, 3.0), False),         # the line beyond the end would meet it
    (TANK, (4.0, 3.0), (4.0, 3.0), True),
])
def test_a_link_whose_way_meets_a_zone_is_weak_if_the_zone_acts_on_the_path(zone, one, other, weak):
    assert zone.weakens(one, other) is zone.weakens(other, one) is weak


@given(one=place, other=place)
def test_paths_are_those_of_which_a_fine_subdivision_meets_the_zone(one, other):
    points = [tuple(a + k / 2000 * (b - a) for a, b in zip(one, other, strict=True)) for k in range(2001)]
    step = dist(one, other) / 2000

    for zone in (WALL, TANK):
        met = any(zone.holds(point) for point in points)

        assert zone.weakens(one, other) or not met
        if zone.weakens(one, other) and not met:    # the way only grazes it: within one step of an edge or corner
            outside = [max(0.0, hypot(x - 4.0, y - 3.0) - 2.0) if zone is TANK else
                       hypot(max(4.0 - x, 0.0, x - 5.0), max(-1.0 - y, 0.0, y - 1.0)) for x, y in points]
            assert min(outside) <= step


def test_a_zone_that_acts_on_the_ends_lets_a_path_pass():
    wall = Rectangle("rectangle", (4.0, -1.0), (5.0, 1.0), 20.0)

    assert not wall.weakens((0.0, 0.0), (9.0, 0.0))
    assert wall.weakens((4.5, 0.0), (9.0, 0.0))


@given(turn=st.floats(0, 6.3))
def test_the_extent_of_a_zone_is_that_of_the_points_on_its_edge(turn):
    ux, uy = cos(turn), sin(turn)
    round_tank = [(4.0 + 2.0 * cos(k / 500), 3.0 + 2.0 * sin(k / 500)) for k in range(3142)]
    corners = [(x, y) for x in (4.0, 5.0) for y in (-1.0, 1.0)]

    for zone, points in ((WALL, corners), (TANK, round_tank)):
        assert zone.extent_m(ux, uy) == pytest.approx(max(ux * x + uy * y for x, y in points), abs=2e-6)
