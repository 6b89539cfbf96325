"""Circles and lines against complex arithmetic and brute force."""

from math import cos, hypot, pi, sin
from random import Random

import pytest

from agents.estimation.circle_fit import fit
from agents.estimation.curve import Curve

CURVATURES = [0.0, 1e-12, -1e-7, 1e-3, 0.4, -0.4, 2.0, -3.0]


@pytest.mark.parametrize("k_per_m", CURVATURES)
def test_points_foot_and_distance_agree_with_the_circle_they_belong_to(k_per_m):
    rng = Random(k_per_m)
    curve = Curve(0.3, -0.7, cos(0.9), sin(0.9), k_per_m)
    reach_m = min(2.0, 0.9 * pi / abs(k_per_m)) if k_per_m else 2.0

    for _ in range(50):
        s_m, aside_m = rng.uniform(-reach_m, reach_m), rng.uniform(-0.2, 0.2)
        x, y = curve.at(s_m)
        heading = curve.heading_rad(s_m)
        point = x - aside_m * sin(heading), y + aside_m * cos(heading)

        assert curve.foot_m(*point) == pytest.approx(s_m, abs=1e-9)
        assert curve.distance_m(*point) == pytest.approx(aside_m, abs=1e-9)
        moved = curve.moved_to(s_m)
        assert moved.at(0.1) == pytest.approx(curve.at(s_m + 0.1), abs=1e-12)


@pytest.mark.parametrize("k_per_m", [0.4, -0.4, 2.0])
def test_a_circle_is_where_its_centre_and_radius_say(k_per_m):
    curve = Curve(1.0, 2.0, cos(0.4), sin(0.4), k_per_m)
    centre = 1.0 - sin(0.4) / k_per_m, 2.0 + cos(0.4) / k_per_m

    for s_m in (-1.0, 0.0, 0.5, 3.0):
        x, y = curve.at(s_m)
        assert hypot(x - centre[0], y - centre[1]) == pytest.approx(1 / abs(k_per_m), abs=1e-12)
    assert curve.turn_m == pytest.approx(2 * pi / abs(k_per_m))


@pytest.mark.parametrize("radius_m", [0.2, 1.0, 8.0, 1e3, 1e6])
@pytest.mark.parametrize("turn_rad", [0.5, 2.0, 6.28])
def test_points_on_a_circle_give_that_circle(radius_m, turn_rad):
    """Rounding of points of size r moves them by about 2^-52 r; the sagitta that says the radius is r turn^2 / 8."""
    n = 17
    points = [(3 + radius_m * cos(turn_rad * k / n), 4 + radius_m * sin(turn_rad * k / n)) for k in range(n)]

    found = fit(points)

    assert abs(found.circle.k_per_m) * radius_m == pytest.approx(1, rel=1e-9 / min(1, turn_rad ** 2 / 8))
    assert found.circle_rss_m2 < n * (1e-9 * radius_m) ** 2
    assert found.line_rss_m2 > 100 * found.circle_rss_m2


@pytest.mark.parametrize("n", [4, 6, 12, 17])
def test_points_all_around_a_circle_give_it_with_the_mean_as_its_centre(n):
    points = [(3 + 2 * cos(2 * pi * k / n), 4 + 2 * sin(2 * pi * k / n)) for k in range(n)]

    circle = fit(points).circle

    assert abs(circle.k_per_m) == pytest.approx(0.5, rel=1e-9)
    assert hypot(circle.x_m - 3, circle.y_m - 4) == pytest.approx(2, rel=1e-9)


@pytest.mark.parametrize("angle", [0.0, 0.3, pi / 2, 2.5, -1.0])
def test_points_on_a_line_give_a_line_of_no_curvature(angle):
    points = [(1 + k * 0.1 * cos(angle), -2 + k * 0.1 * sin(angle)) for k in range(9)]

    found = fit(points)

    assert abs(found.circle.k_per_m) < 1e-6
    assert found.line_rss_m2 < 1e-24
    assert abs(found.line.tx * sin(angle) - found.line.ty * cos(angle)) < 1e-12


def test_noisy_points_give_the_smallest_value_of_pratts_objective():
    """sum F^2 / n over (B^2 + C^2 - 4 A D), by a general solver from many starts."""
    import numpy as np
    from scipy.linalg import eig

    rng = np.random.default_rng(9)
    for turn_rad in (0.3, 1.0, 4.0):
        angles = np.linspace(0, turn_rad, 17)
        x, y = 1.5 * np.cos(angles) + rng.normal(0, 0.1, 17), 1.5 * np.sin(angles) + rng.normal(0, 0.1, 17)
        Z = np.stack([x * x + y * y, x, y, np.ones(17)])
        B = np.array([[0, 0, 0, -2], [0, 1, 0, 0], [0, 0, 1, 0], [-2, 0, 0, 0]])
        values, vectors = eig(Z @ Z.T, B)
        real = [k for k in range(4) if abs(values[k].imag) < 1e-9 and values[k].real >= -1e-9]
        best = min(real, key=lambda k: values[k].real)
        a, b, c, d = vectors[:, best].real
        k_per_m = 2 * abs(a) / np.sqrt(b * b + c * c - 4 * a * d)

        found = fit(list(zip(x.tolist(), y.tolist(), strict=True)))

        assert abs(found.circle.k_per_m) == pytest.approx(k_per_m, rel=1e-8)


def test_few_points_are_refused_and_points_that_coincide_are_a_line():
    with pytest.raises(ValueError, match="needs 3 or more"):
        fit([(0.0, 0.0), (1.0, 1.0)])

    assert fit([(1.0, 2.0)] * 5).circle == Curve(1.0, 2.0, 1.0, 0.0, 0.0)
