"""The law against its own velocity in small steps; zones and what makes them sure, by hand."""

import re
from math import exp, hypot, nan

import pytest

from agents.pursuit.law import Area, PursuitLaw
from agents.pursuit.no_escape import least_escape_m, problems
from agents.pursuit.zones import Zones

STEP_NS = 70_000_000
SURE = Zones(2.3, 1.15, 0.55)


def test_near_the_detection_the_distance_falls_exponentially():
    there = PursuitLaw(gain_per_s=0.8).moved((0.0, 0.0), (1.0, 0.5), 1.7)

    assert hypot(there[0] - 1.0, there[1] - 0.5) == pytest.approx(hypot(1.0, 0.5) * exp(-0.8 * 1.7), rel=1e-12)


def test_far_from_it_the_pursuer_drives_at_its_full_speed():
    law = PursuitLaw(gain_per_s=1.0, u_max_mps=2.0)

    assert law.velocity_mps((0.0, 0.0), (30.0, 40.0)) == pytest.approx((1.2, 1.6))
    assert law.moved((0.0, 0.0), (30.0, 40.0), 10.0) == pytest.approx((12.0, 16.0))


@pytest.mark.parametrize("goal", [(0.7, -0.2), (3.0, 1.0), (-9.0, 4.0)])
@pytest.mark.parametrize("area", [None, Area((-5.0, 2.0), (-1.0, 3.0))])
def test_moving_is_the_integral_of_the_velocity(goal, area):
    """Euler steps err by at most K^2 |y - q| T dt / 2 each way, here 1.44 * 10 * 3 * 1e-4 / 2."""
    law, own, dt_s = PursuitLaw(gain_per_s=1.2, u_max_mps=2.0, area=area), (0.3, 0.1), 1e-4
    expected = law.moved(own, goal, 3.0)

    for _ in range(30_000):
        vx, vy = law.velocity_mps(own, goal)
        own = own[0] + vx * dt_s, own[1] + vy * dt_s

    assert own == pytest.approx(expected, abs=1.44 * 10 * 3 * dt_s / 2)


def test_a_detection_outside_the_area_is_approached_within_it():
    law = PursuitLaw(area=Area((-1.0, 1.0), (-2.0, 2.0)))

    assert law.moved((0.0, 0.0), (5.0, -3.0), 100.0) == pytest.approx((1.0, -2.0))


def test_where_the_detection_is_the_pursuer_stays():
    law = PursuitLaw()

    assert law.velocity_mps((1.0, 2.0), (1.0, 2.0)) == (0.0, 0.0)
    assert law.moved((1.0, 2.0), (1.0, 2.0), 5.0) == (1.0, 2.0)


def test_distances_to_the_boundary_are_negative_outside():
    assert SURE.distance_m((1.0, 0.0), (1.0, 2.0)) == pytest.approx(0.3)
    assert SURE.distance_m((1.0, 0.0), (1.0, -3.0)) == pytest.approx(-0.7)


def test_the_zones_are_those_of_figure_3_2():
    own = (0.0, 0.0)
    assert [SURE.stays(own, (x, 0.0)) for x in (0.0, 1.15, 1.16, 2.4)] == [True, True, False, False]
    assert [SURE.may_escape(own, (x, 0.0)) for x in (0.0, 1.74, 1.76, 2.3, 2.31)] == [False, False, True, True, False]


@pytest.mark.parametrize(("wrong", "words"), [
    ((0.0, 0.1, 0.1), "radius_m=0.0"), ((nan, 0.1, 0.1), "radius_m=nan"), ((2.0, 2.0, 0.1), "no_moving_m=2.0"),
    ((2.0, 0.0, 0.1), "no_moving_m=0.0"), ((2.0, 1.0, 2.5), "escape_m=2.5"), ((2.0, 1.0, nan), "escape_m=nan")])
def test_zones_that_do_not_fit_the_field_of_view_are_refused(wrong, words):
    with pytest.raises(ValueError, match=words):
        Zones(*wrong)


@pytest.mark.parametrize(("wrong", "words"), [({"gain_per_s": 0.0}, "gain_per_s=0.0"), ({"u_max_mps": nan}, "nan")])
def test_a_law_without_gain_or_speed_is_refused(wrong, words):
    with pytest.raises(ValueError, match=words):
        PursuitLaw(**wrong)


def test_an_empty_area_is_refused():
    with pytest.raises(ValueError, match=r"y_m=\(2.0, 2.0\): expected from, to"):
        Area((0.0, 1.0), (2.0, 2.0))


# --- what makes it sure

def test_the_escape_area_needs_two_steps_and_the_noise():
    """2 * 0.07 s * 0.7 m/s + 4.5 * 0.1 m = 0.548 m, and a latency its own way more."""
    assert least_escape_m(0.7, 0.1, STEP_NS) == pytest.approx(0.548)
    assert least_escape_m(0.7, 0.1, STEP_NS, 3 * STEP_NS) == pytest.approx(0.695)
    assert least_escape_m(0.7, 0.1, STEP_NS, 2 * STEP_NS, losses=2) == pytest.approx(10 * 0.049 + 0.45)
    assert problems(Zones(2.3, 1.15, 0.548), PursuitLaw(), 0.7, 0.1, STEP_NS) == []
    assert problems(Zones(2.3, 1.15, 0.547), PursuitLaw(), 0.7, 0.1, STEP_NS) != []


@pytest.mark.parametrize(("zones", "law", "words"), [
    (Zones(2.3, 1.15, 0.147), PursuitLaw(), "escape_m=0.147.*take 0.548 m or more"),
    (Zones(2.3, 0.6, 0.55), PursuitLaw(), "no_moving_m=0.6.*slower than the target.*take 0.7 m or more"),
    (SURE, PursuitLaw(gain_per_s=0.5), "no_moving_m=1.15: with a gain of 0.5 /s"),
    (SURE, PursuitLaw(u_max_mps=0.7), "u_max_mps=0.7: the pursuer has to be faster"),
    (Zones(1.8, 1.15, 0.55), PursuitLaw(), "too small for its zones; take at most 1.103 m, or a radius of 1.847 m")])
def test_each_condition_of_the_theorem_is_told_with_its_remedy(zones, law, words):
    (found,) = problems(zones, law, 0.7, 0.1, STEP_NS)

    assert re.search(words, found)
