"""A chart of heights refuses what cannot be drawn."""

from __future__ import annotations

from typing import Any

import pytest

from firmware_sim.height_chart import HeightChart

GOOD: dict[str, Any] = {"title": "hill", "note": "", "x_axis": "x [m]", "y_axis": "y [m]", "unit": "m",
                        "x": [0.0, 1.0, 5.0], "y": [0.0, 2.0], "z": [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]}


def test_a_row_for_each_y_and_a_column_for_each_x_is_taken() -> None:
    assert HeightChart(**GOOD).z[1][2] == 5.0


@pytest.mark.parametrize(("wrong", "said"), [
    ({"x": [0.0, 0.0, 1.0]}, "hill: x=[0.0, 0.0, 1.0]: expected ascending numbers"),
    ({"y": [0.0, float("inf")]}, "hill: y=[0.0, inf]: expected ascending numbers"),
    ({"z": [[0.0, 1.0, 2.0]]}, "hill: z has 1 rows of [3] heights: expected 2 rows of 3"),
    ({"z": [[0.0, 1.0], [2.0, 3.0]]}, "hill: z has 2 rows of [2] heights: expected 2 rows of 3"),
    ({"z": [[0.0, 1.0, 2.0], [3.0, 4.0, float("nan")]]}, "hill: z has heights that are no finite numbers")])
def test_what_cannot_be_drawn_is_refused(wrong: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError) as refused:
        HeightChart(**(GOOD | wrong))

    assert str(refused.value).startswith(said)
