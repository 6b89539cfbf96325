"""P_S^k against closed forms, inclusion-exclusion over cones, and Monte Carlo."""

from itertools import combinations
from math import comb, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agents.marco_polo.sight import boundary, seen
from agents.marco_polo.track_coverage import Headings, coverage_with, track_coverage
from tests.agents.marco_polo.layouts import AREA, CENTRES, RADII
from tests.examples import examples

CELLS = 200
TRACKS = 200_000


@pytest.mark.parametrize(("centre", "expected"), [((5.0, 5.0), 0.11283), ((1.0, 1.0), 0.16951)])
def test_one_disc_and_uniform_headings(centre, expected):
    assert track_coverage(AREA, [centre], 1.0)[0] == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize(("centre", "perimeter"), [((5.0, 5.0), 2 * pi), ((5.0, 0.0), pi + 2.0)])
def test_isotropic_lines_meet_a_convex_set_in_the_ratio_of_perimeters(centre, perimeter):
    found = track_coverage(AREA, [centre], 1.0, Headings.ISOTROPIC, boundary_cells=3200)

    assert found[0] == pytest.approx(perimeter / 40.0, abs=1e-5)


@pytest.mark.parametrize(("headings", "expected"), [(Headings.UNIFORM, (0.6037, 0.3754, 0.1055)),
                                                    (Headings.ISOTROPIC, (0.7157, 0.4694, 0.1468))])
def test_the_reference_layout(headings, expected):
    assert track_coverage(AREA, CENTRES, RADII, headings)[:3] == pytest.approx(expected, abs=1e-4)


def by_cones(low, high, weights, k):
    """The dissertation's way ([84]): inclusion-exclusion over intersections of the cones, at each boundary point."""
    total = 0.0
    sensors = low.shape[1]
    for size in range(k, sensors + 1):
        sign = (-1) ** (size - k) * comb(size - 1, k - 1)
        for chosen in combinations(range(sensors), size):
            common = high[:, chosen].min(axis=1) - low[:, chosen].max(axis=1)
            total += sign * float(weights @ np.maximum(common, 0.0))
    return total


@pytest.mark.parametrize("headings", Headings)
@pytest.mark.parametrize("layout", ["reference", "at the walls", "all at one place"])
def test_sorted_intervals_equal_inclusion_exclusion_of_cones(headings, layout):
    generator = np.random.default_rng(5)
    centres = {"reference": CENTRES, "at the walls": generator.choice([0.0, 10.0, 5.0], (7, 2)),
               "all at one place": np.full((7, 2), 3.0)}[layout]

    found = track_coverage(AREA, centres, RADII, headings, CELLS)

    edge = boundary(AREA, CELLS)
    low, high = (headings.share(end) for end in seen(AREA, edge.places_m, edge.axes_rad, centres, RADII))
    assert found == pytest.approx([by_cones(low, high, edge.weights, k) for k in range(1, 8)], abs=1e-10)


def crossings(headings, generator, tracks, centres, radii):
    """Fields of view that each random track meets: chords inside the area and their distances, no angles."""
    side, along = generator.integers(4, size=tracks), generator.uniform(0.0, 10.0, tracks)
    x = np.choose(side, [along, np.full(tracks, 10.0), along, np.zeros(tracks)])
    y = np.choose(side, [np.zeros(tracks), along, np.full(tracks, 10.0), along])
    normal = np.choose(side, [pi / 2, pi, -pi / 2, 0.0])
    share = generator.uniform(-1.0, 1.0, tracks)
    heading = normal + (share * pi / 2 if headings is Headings.UNIFORM else np.arcsin(share))
    ux, uy = np.cos(heading), np.sin(heading)
    with np.errstate(divide="ignore"):
        length = np.minimum(np.where(ux > 0, (10.0 - x) / ux, -x / ux), np.where(uy > 0, (10.0 - y) / uy, -y / uy))
    foot = np.clip((centres[:, 0] - x[:, None]) * ux[:, None] + (centres[:, 1] - y[:, None]) * uy[:, None], 0.0,
                   length[:, None])
    distance = np.hypot(x[:, None] + foot * ux[:, None] - centres[:, 0],
                        y[:, None] + foot * uy[:, None] - centres[:, 1])
    return (distance <= radii).sum(axis=1)


@pytest.mark.parametrize("headings", Headings)
@pytest.mark.parametrize("shift", [0.0, 1.2])
def test_monte_carlo_agrees_within_three_standard_errors(headings, shift):
    centres = np.clip((CENTRES - 5.0) * (1.0 + shift / 5.0) + 5.0, 0.0, 10.0)
    met = crossings(headings, np.random.default_rng(11), TRACKS, centres, RADII)

    found = track_coverage(AREA, centres, RADII, headings, boundary_cells=800)

    for k in range(1, 8):
        share = float(np.mean(met >= k))
        error = sqrt(max(found[k - 1], 1.0 / TRACKS) / TRACKS)
        assert abs(share - found[k - 1]) <= 3.0 * error, k


discs = st.lists(st.tuples(st.floats(0.0, 10.0), st.floats(0.0, 10.0), st.floats(0.2, 3.0)), min_size=1, max_size=6)


@settings(max_examples=examples(50), deadline=None)
@given(discs)
def test_more_detections_are_less_probable_and_one_more_sensor_never_hurts(sensors):
    table = np.array(sensors)
    all_of_them = track_coverage(AREA, table[:, :2], table[:, 2], boundary_cells=40)

    fewer = track_coverage(AREA, table[:-1, :2], table[:-1, 2], boundary_cells=40)

    assert np.all(np.diff(all_of_them) <= 1e-12)
    assert np.all((all_of_them >= -1e-12) & (all_of_them <= 1.0 + 1e-12))
    assert np.all(fewer <= all_of_them[:-1] + 1e-12)


@settings(max_examples=examples(50), deadline=None)
@given(discs, st.integers(1, 7), st.sampled_from(Headings))
def test_the_coverage_with_one_more_sensor_is_that_of_all(sensors, k, headings):
    table = np.array(sensors)

    found = coverage_with(AREA, table[1:, :2], table[1:, 2], k, table[:1, :2], table[0, 2], headings, 40)

    whole = track_coverage(AREA, table[:, :2], table[:, 2], headings, 40)
    assert found[0] == pytest.approx(whole[k - 1] if k <= len(whole) else 0.0, abs=1e-12)


def test_no_sensor_covers_no_track():
    assert track_coverage(AREA, np.empty((0, 2)), np.empty(0)).shape == (0,)
    with pytest.raises(ValueError, match="k=0"):
        coverage_with(AREA, CENTRES, RADII, 0, CENTRES, 1.0)
