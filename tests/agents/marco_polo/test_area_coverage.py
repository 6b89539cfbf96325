from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import box, union_all
from shapely.geometry import Point

from agents.marco_polo.area_coverage import area_coverage, area_coverage_gradient, greatest_area_coverage
from tests.agents.marco_polo.layouts import AREA, CENTRES, RADII
from tests.examples import examples


def test_the_reference_layout_covers_a_third():
    assert area_coverage(AREA, CENTRES, RADII) == pytest.approx(0.3333, abs=1e-3)
    assert greatest_area_coverage(AREA, RADII) == pytest.approx(pi * float(np.sum(RADII ** 2)) / 100.0)
    assert greatest_area_coverage(AREA, [20.0]) == 1.0


discs = st.lists(st.tuples(st.floats(-1.0, 11.0), st.floats(-1.0, 11.0), st.floats(0.3, 3.0)), min_size=1, max_size=6)


@settings(max_examples=examples(60), deadline=None)
@given(discs)
def test_scan_lines_agree_with_the_union_of_shapelys_polygons(sensors):
    table = np.array(sensors)

    found = area_coverage(AREA, table[:, :2], table[:, 2], 2000)

    union = union_all([Point(x, y).buffer(r, quad_segs=64) for x, y, r in sensors]).intersection(box(0, 0, 10, 10))
    polygons = 1e-4 * float(np.sum(pi * table[:, 2] ** 2)) / 100.0          # 1 - sin(pi/128) / (pi/128) of each disc
    lines = 2.0 * 0.2 * float(np.sum((10.0 / 2000) ** 1.5 * np.sqrt(8.0 * table[:, 2]))) / 100.0    # at top and bottom
    assert found == pytest.approx(union.area / 100.0, abs=polygons + lines)


def test_the_gradient_is_that_of_the_exact_area():
    generator = np.random.default_rng(1)
    centres = generator.uniform(0.0, 10.0, (7, 2))

    found = area_coverage_gradient(AREA, centres, RADII, 4000)

    step = 0.01
    for sensor in range(7):
        for axis in (0, 1):
            moved = [centres.copy(), centres.copy()]
            moved[0][sensor, axis] -= step
            moved[1][sensor, axis] += step
            less, more = (area_coverage(AREA, at, RADII, 8000) for at in moved)
            assert found[sensor, axis] == pytest.approx((more - less) / (2 * step), abs=2e-4)


def test_without_sensors_or_scan_lines():
    assert area_coverage(AREA, np.empty((0, 2)), []) == 0.0
    with pytest.raises(ValueError, match="scan_lines=0"):
        area_coverage(AREA, CENTRES, RADII, 0)
