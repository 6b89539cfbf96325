"""Cells of Tables 3.1 to 3.4, with few runs; all of them: `marconet table`."""

from math import pi

import numpy as np
import pytest

from agents.estimation.monte_carlo import FILTERS, circle, errors_m
from agents.estimation.paths import INSTANTS, STEP_NS, circular, zig_zag


def test_the_circle_is_one_turn_in_55_s():
    """omega's ripple has whole periods of 7 s: 0.05 (2 pi / 55) 7 / (2 pi) rad is the most it adds."""
    path = circular()

    assert path.x.shape == (INSTANTS,)
    assert abs(path.theta[-1] - 2 * pi * 0.07 * (INSTANTS - 1) / 55) <= 0.05 * 7 / 55
    assert path.v.max() == pytest.approx(0.55 * 1.05, rel=1e-3)


def test_the_zig_zag_goes_straight_then_back_while_it_turns():
    path, t = zig_zag(), np.arange(INSTANTS) * 0.07

    assert np.all(path.v[t < 3.4] == pytest.approx(0.7))
    assert np.all(path.omega[t < 3.4] == pytest.approx(0.0, abs=1e-9))
    back = (t > 3.4 + 0.35) & (t < 4.9)
    assert np.all(path.v[back] == pytest.approx(-0.4))
    assert np.all(path.omega[back] == pytest.approx(1.5))
    assert np.all(path.omega[back.nonzero()[0] + 70] == pytest.approx(-1.5))        # 4.9 s later


# path, detections, filter, expected, tolerance [m]: NUMBERS; 12 runs add 4 standard errors
@pytest.mark.parametrize(("path", "detections", "name", "expected", "tolerance"), [
    (circular, 100, "UKF", 0.109, 0.006), (circular, 22, "UKF", 0.174, 0.03), (circular, 31, "PF", 0.193, 0.02),
    (zig_zag, 100, "UKF", 0.129, 0.01), (zig_zag, 25, "UKF", 1.086, 0.05), (zig_zag, 25, "PF", 0.835, 0.05)])
def test_cells_are_what_the_dissertations_tables_allow(path, detections, name, expected, tolerance):
    found = errors_m(FILTERS[name], path(), detections, 12)

    assert abs(found.mean() - expected) <= tolerance + 4 * found.std(ddof=1) / 12 ** 0.5


# the same of the circle filter, with Gamma
@pytest.mark.parametrize(("path", "window", "detections", "expected", "tolerance"), [
    (circular, 17, 100, 0.135, 0.006), (circular, 17, 22, 0.261, 0.03), (zig_zag, 3, 100, 0.215, 0.01),
    (zig_zag, 3, 25, 0.889, 0.03)])
def test_cells_of_the_circle_filter_are_what_the_dissertations_tables_allow(path, window, detections, expected,
                                                                            tolerance):
    found = errors_m(circle(window), path(), detections, 12, first=3)

    assert abs(found.mean() - expected) <= tolerance + 4 * found.std(ddof=1) / 12 ** 0.5


def test_detections_are_at_the_floors_of_equal_parts_and_an_instant_is_judged_after_its_detection():
    class Perfect:
        def __init__(self) -> None:
            self.seen: list[int] = []
            self.at = 0.0, 0.0

        def correct(self, t_ns, x_m, y_m, inputs):
            self.seen.append(t_ns // STEP_NS)
            return True

        def expect(self, t_ns):
            k = t_ns // STEP_NS
            return (path.x[k] + 1.0, path.y[k]) if self.seen[-1] < k else (path.x[k], path.y[k])

    path, perfect = circular(), Perfect()

    errors = errors_m(lambda start, inputs, rng: perfect, path, 17, 1)

    assert perfect.seen == [786 * k // 17 for k in range(17)]
    assert errors == pytest.approx([((786 - 17) / 786) ** 0.5], rel=1e-12)


def test_a_run_depends_on_its_seed_and_number_only():
    few, many = (errors_m(FILTERS["UKF"], circular(), 31, runs).tolist() for runs in (2, 3))

    assert many[:2] == few
