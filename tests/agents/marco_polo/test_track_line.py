from math import cos, degrees, pi, sin

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from agents.marco_polo.track_line import fit_track
from tests.agents.marco_polo.layouts import AREA


def test_the_line_of_the_specification_is_total_least_squares():
    track = fit_track([(1.0, 1.0), (2.0, 2.2), (3.0, 2.9)])

    assert track.centroid == pytest.approx((2.0, 2.0333), abs=1e-3)
    assert degrees(track.heading_rad) == pytest.approx(43.845, abs=1e-3)
    assert track.exit_point(AREA) == pytest.approx((10.0, 9.717), abs=1e-3)
    ordinary = np.degrees(np.arctan(np.polyfit([1.0, 2.0, 3.0], [1.0, 2.2, 2.9], 1)[0]))
    assert abs(ordinary - 43.845) > 0.1


place = st.tuples(st.floats(0.0, 10.0), st.floats(0.0, 10.0))


@settings(deadline=None)
@given(st.lists(place, min_size=3, max_size=8))
def test_no_line_has_a_smaller_sum_of_squared_distances(detections):
    points = np.array(detections)
    assume(np.ptp(points, axis=0).max() > 0.1)

    track = fit_track(detections)

    def rss(heading):
        return float(np.sum(((points - points.mean(axis=0)) @ [-sin(heading), cos(heading)]) ** 2))

    assert track.centroid == pytest.approx(tuple(points.mean(axis=0)), abs=1e-9)
    assert rss(track.heading_rad) <= min(rss(angle) for angle in np.linspace(0.0, pi, 181)) + 1e-9
    least = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[-1] ** 2
    assert rss(track.heading_rad) == pytest.approx(least, abs=1e-9)


@given(place, st.floats(-3.1, 3.1), st.integers(2, 5))
def test_an_exact_track_is_found_with_its_direction_and_left_where_it_leads(start, heading, count):
    detections = [(start[0] + 0.3 * i * cos(heading), start[1] + 0.3 * i * sin(heading)) for i in range(count)]
    assume(all(0.0 <= x <= 10.0 and 0.0 <= y <= 10.0 for x, y in detections))

    track = fit_track(detections)
    x, y = track.exit_point(AREA)

    assert cos(track.heading_rad - heading) == pytest.approx(1.0, abs=1e-9)
    assert track.last == pytest.approx(detections[-1], abs=1e-9)
    assert 0.0 <= x <= 10.0
    assert 0.0 <= y <= 10.0
    assert min(x, y, 10.0 - x, 10.0 - y) == pytest.approx(0.0, abs=1e-9)
    across = (x - start[0]) * sin(heading) - (y - start[1]) * cos(heading)
    along = (x - detections[-1][0]) * cos(heading) + (y - detections[-1][1]) * sin(heading)
    assert across == pytest.approx(0.0, abs=1e-6)
    assert along >= -1e-6


def test_one_detection_takes_the_normal_of_the_nearest_wall():
    assert fit_track([(9.8, 4.0)], AREA).heading_rad == pytest.approx(pi)
    assert fit_track([(5.0, 0.5)], AREA).heading_rad == pytest.approx(pi / 2)


@pytest.mark.parametrize(("detections", "why"), [([], "2 or more"), ([(1.0, 1.0)], "2 or more"),
                                                 ([(1.0, 1.0)] * 3, "2 different places"),
                                                 ([(1.0, 1.0), (float("nan"), 2.0)], "finite")])
def test_detections_without_a_line_are_refused(detections, why):
    with pytest.raises(ValueError, match=why):
        fit_track(detections)


def test_a_target_outside_has_no_exit_point():
    with pytest.raises(ValueError, match="has left it"):
        fit_track([(8.0, 5.0), (11.0, 5.0)]).exit_point(AREA)
