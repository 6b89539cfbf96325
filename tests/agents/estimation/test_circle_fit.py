"""The fit of a circle and a line, with detections that repeat."""

from __future__ import annotations

from math import isfinite

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from agents.estimation.circle_fit import fit


@given(st.lists(st.tuples(st.integers(-2, 2), st.integers(-2, 2)), min_size=3, max_size=8))
@example([(0, 0), (0, 0), (1, 1)])
@example([(1, 1), (1, 1), (1, 1)])
def test_repeated_detections_fit_too(places: list[tuple[int, int]]) -> None:
    points = [(float(x), float(y)) for x, y in places]

    found = fit(points)

    assert all(isfinite(value) for value in (*found.circle, *found.line, found.circle_rss_m2, found.line_rss_m2))
    on_line = sum(found.line.distance_m(x, y) ** 2 for x, y in points)
    assert found.line_rss_m2 == pytest.approx(on_line, abs=1e-9)
