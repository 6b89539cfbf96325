"""Where a target can be: closed forms of disks, and no way of a target ever leads out of the set."""

from __future__ import annotations

from math import cos, dist, hypot, pi, sin

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from agents.marco_polo_game.reachable_set import OUTER, EmptyView, ReachableSet
from agents.pursuit.law import Area
from tests.examples import examples

S, MS = 1_000_000_000, 1_000_000
AREA = Area((0.0, 10.0), (0.0, 10.0))
V_MAX_MPS, RADIUS_M = 0.7, 1.0


def test_it_grows_from_a_detection_at_the_greatest_speed() -> None:
    reach = ReachableSet(AREA, V_MAX_MPS)

    reach.seen(S, (5.0, 5.0))

    grown = reach.region(3 * S)
    assert pi * 1.4 ** 2 <= grown.area <= pi * (1.4 * OUTER) ** 2
    assert not reach.left(3 * S)


def test_it_ends_at_the_boundary_of_the_area() -> None:
    reach = ReachableSet(AREA, V_MAX_MPS)

    reach.seen(0, (0.0, 0.0))

    assert 0.25 * pi * 1.4 ** 2 <= reach.region(2 * S).area <= 0.25 * pi * (1.4 * OUTER) ** 2


def test_without_a_detection_it_is_the_area_and_without_looks_no_target_has_left() -> None:
    reach = ReachableSet(AREA, V_MAX_MPS)

    assert reach.region(S).area == 100.0
    reach.seen(S, (0.0, 5.0))
    assert not reach.left(1000 * S)


@pytest.mark.parametrize(("after_ns", "left"), [(1250 * MS, True), (1450 * MS, False)])
def test_a_look_that_covers_what_is_in_the_area_proves_that_the_target_has_left(after_ns: int, left: bool) -> None:
    """From 0.3 m off the wall a view of 1 m covers the wall 0.954 m to both sides, which takes a target 1.363 s."""
    reach = ReachableSet(AREA, V_MAX_MPS)
    reach.seen(0, (0.0, 5.0))

    reach.not_seen(EmptyView(after_ns, (0.3, 5.0), RADIUS_M))

    assert reach.left(after_ns) is left
    reach.seen(after_ns, (0.0, 5.0))                    # it was there after all
    assert not reach.left(after_ns)


def test_a_late_detection_keeps_the_looks_after_it() -> None:
    reach = ReachableSet(AREA, V_MAX_MPS)
    reach.seen(0, (5.0, 5.0))
    reach.not_seen(EmptyView(4 * S, (0.0, 5.0), RADIUS_M))

    reach.seen(3900 * MS, (0.0, 5.0))                   # another sensor's, told later than the look

    assert reach.left(4 * S)
    reach.seen(3800 * MS, (9.0, 9.0))                   # older than the newest: nothing changes
    assert reach.left(4 * S)


def test_the_nearest_place_stands_for_one_that_looks_have_refuted() -> None:
    reach = ReachableSet(AREA, V_MAX_MPS)
    reach.seen(0, (5.0, 5.0))
    reach.not_seen(EmptyView(2 * S, (5.0, 5.0), RADIUS_M))     # a ring from 1 m to 1.4 m is left

    x, y = reach.nearest((5.5, 5.0), 2 * S)

    assert hypot(x - 5.0, y - 5.0) == pytest.approx(1.0, abs=RADIUS_M * (OUTER - 1))
    assert x > 5.9
    assert reach.nearest((5.0, 6.2), 2 * S) == (5.0, 6.2)


steps = st.lists(st.tuples(st.floats(-pi, pi), st.floats(0.0, V_MAX_MPS), st.floats(0.0, 10.0), st.floats(0.0, 10.0),
                           st.booleans()), min_size=1, max_size=25)


@given(st.floats(0.0, 10.0), st.floats(0.0, 10.0), steps, st.floats(0.0, 0.5), st.floats(-pi, pi))
@settings(max_examples=examples(60), deadline=None)
def test_a_target_in_the_area_is_in_the_set_whatever_looks_do_not_see_it(
        x: float, y: float, steps: list[tuple[float, float, float, float, bool]], off_m: float,
        off_rad: float) -> None:
    """Each step lasts 0.4 s; a look from a drawn place follows it, and at times detects the target, `off_m` off."""
    reach = ReachableSet(AREA, V_MAX_MPS, off_m)
    off_x, off_y = off_m * cos(off_rad), off_m * sin(off_rad)
    reach.seen(0, (x, y))
    for number, (heading_rad, speed_mps, look_x, look_y, detects) in enumerate(steps, 1):
        at_ns = number * 400 * MS
        x, y = AREA.nearest((x + 0.4 * speed_mps * cos(heading_rad), y + 0.4 * speed_mps * sin(heading_rad)))
        if dist((x, y), (look_x, look_y)) > RADIUS_M:
            reach.not_seen(EmptyView(at_ns, (look_x, look_y), RADIUS_M))
        elif detects:
            reach.seen(at_ns, (x + off_x, y + off_y))

        assert reach.region(at_ns).distance(shapely.Point(x, y)) < 1e-9
        assert not reach.left(at_ns)
