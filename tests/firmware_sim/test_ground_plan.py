from __future__ import annotations

import pytest

from firmware_sim.ground_plan import GroundPlan, GroundShape, joined

BOX = GroundShape("box", ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0)))


@pytest.mark.parametrize("corners", [((0.0, 0.0), (1.0, 1.0)), ((0.0, 0.0), (1.0, 0.0), (float("nan"), 1.0))])
def test_a_shape_without_three_finite_corners_is_refused(corners) -> None:
    with pytest.raises(ValueError, match=r"box: corners_m=.*: expected 3 or more corners"):
        GroundShape("box", corners)


@pytest.mark.parametrize("side", [(1.0, 1.0), (2.0, 1.0), (0.0, float("inf"))])
def test_an_area_without_extent_is_refused(side) -> None:
    with pytest.raises(ValueError, match=r"area_y_m=\[.*\]: expected \[from, to\], from < to"):
        GroundPlan((0.0, 1.0), side)


def test_plans_join_to_the_area_that_holds_all_with_each_shape_once() -> None:
    zone = GroundShape("zone", BOX.corners_m, solid=False)

    found = joined([GroundPlan((0.0, 2.0), (0.0, 2.0), (BOX,)), GroundPlan((-1.0, 1.0), (1.0, 3.0), (BOX, zone))])

    assert found == GroundPlan((-1.0, 2.0), (0.0, 3.0), (BOX, zone))
    assert joined([]) is None
