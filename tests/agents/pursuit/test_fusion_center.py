"""Who follows whom, and what is told: by hand."""

from math import inf, nan
from random import Random

import pytest

from agents.pursuit.fusion_center import FusionCenter, Reading, weighted_mean

STEP_NS = 70_000_000


@pytest.fixture
def center():
    return FusionCenter(Random(1), keep=3)


def tell(center, sensor, k, place=(0.0, 0.0), sigma_m=0.1, now=None, target="t1"):
    return center.report((now or k) * STEP_NS, Reading(sensor, target, k * STEP_NS, place, sigma_m))


def passed_on(center, sensor, **options):
    return [(found.seen_ns // STEP_NS, found.place) for found in center.pass_on(sensor, **options)]


def test_readings_of_one_instant_are_their_mean_weighted_by_their_variances(center):
    """Weights 1/0.01 and 1/0.04: four fifths and one fifth."""
    center.claim("s1", {"t1"})
    tell(center, "s1", 1, (1.0, 2.0), 0.1)
    tell(center, "s2", 1, (2.0, -3.0), 0.2)

    ((k, place),) = passed_on(center, "s1")

    assert (k, place) == (1, pytest.approx((1.2, 1.0)))


def test_the_weighted_mean_has_the_least_variance():
    """Of all weights: 1 / sum(1 / sigma^2). Against a scan."""
    sigmas = (0.1, 0.25)
    share = weighted_mean([((1.0, 0.0), sigmas[0]), ((0.0, 0.0), sigmas[1])])[0]

    variances = {w / 1000: (w / 1000 * sigmas[0]) ** 2 + ((1 - w / 1000) * sigmas[1]) ** 2 for w in range(1001)}

    assert share == pytest.approx(min(variances, key=variances.__getitem__), abs=1e-3)


def test_the_one_in_charge_is_told_what_is_new_in_order_of_time(center):
    center.claim("s1", {"t1"})
    tell(center, "s2", 2, (0.2, 0.0))
    tell(center, "s1", 1, (0.1, 0.0))
    first = passed_on(center, "s1")
    tell(center, "s2", 3, (0.3, 0.0))

    assert first == [(1, (pytest.approx(0.1), 0.0)), (2, (pytest.approx(0.2), 0.0))]
    assert passed_on(center, "s1") == [(3, (pytest.approx(0.3), 0.0))]
    assert passed_on(center, "s1") == []


def test_only_the_one_in_charge_is_told(center):
    center.claim("s1", {"t1"})
    tell(center, "s1", 1)

    assert passed_on(center, "s2") == []
    assert len(passed_on(center, "s1")) == 1


def test_a_sensor_may_be_told_of_others_looks_only(center):
    center.claim("s1", {"t1"})
    tell(center, "s1", 1)
    tell(center, "s2", 2)
    tell(center, "s1", 3)
    tell(center, "s2", 3)

    assert [k for k, _ in passed_on(center, "s1", with_own=False)] == [2]


def test_a_reading_that_comes_after_its_instant_was_passed_on_is_left_out(center):
    center.claim("s1", {"t1"})
    tell(center, "s1", 5)
    passed_on(center, "s1")

    assert tell(center, "s2", 5, now=6) is False
    assert passed_on(center, "s1") == []


def test_a_late_reading_of_an_instant_that_nobody_else_saw_is_passed_on(center):
    center.claim("s1", {"t1"})
    tell(center, "s1", 5)
    passed_on(center, "s1")

    assert tell(center, "s2", 4, now=6) is True
    assert [k for k, _ in passed_on(center, "s1")] == [4]


def test_a_new_one_in_charge_is_told_late_readings_in_their_place(center):
    center.claim("s1", {"t1"})
    tell(center, "s1", 5)
    passed_on(center, "s1")
    tell(center, "s2", 4, now=6)
    passed_on(center, "s1")

    center.claim("s2", {"t1"})

    assert [k for k, _ in passed_on(center, "s2")] == [4, 5]


def test_a_reading_older_than_all_that_is_kept_is_left_out(center):
    center.claim("s1", {"t1"})
    for k in (4, 5, 6):
        tell(center, "s1", k)
    passed_on(center, "s1")

    assert tell(center, "s2", 3, now=7) is False


def test_a_new_one_in_charge_is_told_all_that_is_kept_and_the_former_is_idle(center):
    center.claim("s1", {"t1"})
    for k in range(1, 6):
        tell(center, "s1", k)
    passed_on(center, "s1")

    assert center.claim("s2", {"t1"}) == "t1"

    assert (center.in_charge_of("t1"), center.target_of("s1"), center.target_of("s2")) == ("s2", None, "t1")
    assert [k for k, _ in passed_on(center, "s2")] == [3, 4, 5]
    assert passed_on(center, "s1") == []


def test_of_a_target_that_nobody_follows_only_the_newest_detections_are_kept(center):
    for k in range(1, 1000):
        tell(center, "s1", k)

    center.claim("s2", {"t1"})

    assert [k for k, _ in passed_on(center, "s2")] == [997, 998, 999]


def test_a_sensor_is_in_charge_of_one_target_only(center):
    center.claim("s1", {"t1"})

    assert center.claim("s1", {"t2"}) is None
    assert (center.target_of("s1"), center.in_charge_of("t2")) == ("t1", None)


def test_of_targets_that_enter_together_each_is_chosen_as_often():
    """Of 400 draws among two: 200, standard deviation 10."""
    chosen = [FusionCenter(Random(seed)).claim("s1", {"t1", "t2"}) for seed in range(400)]

    assert abs(chosen.count("t1") - 200) <= 5 * 10


def test_a_sensor_that_is_released_is_idle(center):
    center.claim("s1", {"t1"})

    center.release("s1")

    assert (center.in_charge_of("t1"), center.claim("s1", set())) == (None, None)


@pytest.mark.parametrize(("seen_ns", "place", "sigma_m", "words"), [
    (1, (nan, 0.0), 0.1, "expected finite numbers"), (1, (0.0, inf), 0.1, "expected finite numbers"),
    (1, (0.0, 0.0), 0.0, "sigma_m=0.0"), (8, (0.0, 0.0), 0.1, "it is from the future"),
    (3, (0.0, 0.0), 0.1, "it has told of this instant already")])
def test_what_cannot_be_a_reading_is_refused(center, seen_ns, place, sigma_m, words):
    center.report(5, Reading("s1", "t1", 3, (0.0, 0.0), 0.1))

    with pytest.raises(ValueError, match=words):
        center.report(7, Reading("s1", "t1", seen_ns, place, sigma_m))
