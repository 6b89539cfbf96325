"""Events as a companion computer has them: late answers, answers of others, none at all."""

import re
from math import nan
from pathlib import Path

import numpy as np
import pytest

from agents.estimation import Inputs
from agents.estimation.circle_filter import CircleFilter
from agents.estimation.particle_filter import ParticleFilter
from agents.estimation.unscented_kalman import UnscentedKalman
from agents.pursuit.law import PursuitLaw
from agents.pursuit.pursuer import adaptive_pursuer
from agents.pursuit.zones import Zones

STEP_NS = 70_000_000
OWN = (0.0, 0.0)
ESTIMATORS = {
    "circle filter": lambda: CircleFilter(3, rho_m=0.2),
    "unscented Kalman filter": lambda: UnscentedKalman((0.0, 0.0, 0.0), (0.1, 0.1, 0.1), 0, Inputs(0.5, 0.0)),
    "particle filter": lambda: ParticleFilter((0.0, 0.0, 0.0), (0.1, 0.1, 0.1), np.random.default_rng(1), 0,
                                              Inputs(0.5, 0.0)),
}


def make(estimator=None, **settings):
    return adaptive_pursuer(estimator or CircleFilter(3, rho_m=0.2), Zones(2.3, 1.15, 0.55), PursuitLaw(),
                            **{"v_max_mps": 0.7, "sigma_m": 0.1, "step_ns": STEP_NS, "rho_m": 0.2, **settings})


@pytest.fixture(params=ESTIMATORS)
def pursuer(request):
    return make(ESTIMATORS[request.param]())


def sees(pursuer, k, place, own=OWN):
    pursuer.asked(k * STEP_NS)
    return pursuer.detected(k * STEP_NS, k * STEP_NS, place, own, Inputs(0.5, 0.0))


def test_before_it_saw_anything_it_stays_and_looks(pursuer):
    decision = pursuer.step(0, OWN)

    assert decision == (STEP_NS, None, (0.0, 0.0), None)


def test_it_drives_to_what_it_saw_outside_its_no_moving_area_and_stays_otherwise(pursuer):
    sees(pursuer, 1, (1.0, 0.0))
    near = pursuer.step(STEP_NS, OWN)
    sees(pursuer, 2, (1.3, 0.0))
    far = pursuer.step(2 * STEP_NS, OWN)

    assert (near.goal, near.velocity_mps) == (None, (0.0, 0.0))
    assert (far.goal, far.velocity_mps) == ((1.3, 0.0), (1.3, 0.0))


def test_until_the_next_detection_it_drives_to_the_last_one_even_when_it_is_near(pursuer):
    sees(pursuer, 1, (1.3, 0.0))

    decision = pursuer.step(9 * STEP_NS, (1.2, 0.0))

    assert decision.goal == (1.3, 0.0)
    assert decision.velocity_mps == pytest.approx((0.1, 0.0))


def test_whatever_filters_the_looks_a_steady_target_is_seldom_looked_at(pursuer):
    """At 0.5 m/s along x; from the no-moving area's edge to doubt it takes at least (1.75 - 1.15 - 0.035) / 0.7 s."""
    looks, own, decision = [], OWN, pursuer.step(0, OWN)
    for k in range(200):
        target = 0.5 * k * 0.07
        if decision.look_ns == k * STEP_NS:
            looks.append(k)
            sees(pursuer, k, (target, 0.0), own)
        decision = pursuer.step(k * STEP_NS, own)
        if decision.goal:
            own = pursuer.law.moved(own, decision.goal, 0.07)
        assert pursuer.zones.distance_m(own, (target, 0.0)) > 0

    assert len(looks) < 25


def test_the_newest_detection_is_the_one_that_was_made_last(pursuer):
    """Answers of two sensors that overtake each other."""
    sees(pursuer, 5, (1.3, 0.0))

    pursuer.detected(7 * STEP_NS, 4 * STEP_NS, (-1.6, 0.0), OWN)

    assert pursuer.step(7 * STEP_NS, OWN).goal == (1.3, 0.0)
    assert pursuer.seen_ns == 5 * STEP_NS


def test_late_answers_make_it_look_earlier():
    """d falls from when the detection was made: an answer 4 steps late leaves 4 steps less."""
    prompt, late = make(), make()
    for k in range(3):
        sees(prompt, k, (0.1, 0.0))
        sees(late, k, (0.1, 0.0))

    prompt.detected(10 * STEP_NS, 10 * STEP_NS, (0.1, 0.0), OWN)
    late.detected(10 * STEP_NS, 6 * STEP_NS, (0.1, 0.0), OWN)

    assert prompt.step(10 * STEP_NS, OWN).look_ns - late.step(10 * STEP_NS, OWN).look_ns == 4 * STEP_NS


def test_a_detection_off_the_estimate_is_looked_at_again_at_once():
    class Stubborn:
        def expect(self, t_ns):
            return 0.5, 0.0

        def correct(self, t_ns, x_m, y_m, inputs=None):
            return True

    pursuer = make(Stubborn())
    for k in range(12):
        sees(pursuer, k, (0.5, 0.19))
    calm = pursuer.step(11 * STEP_NS, OWN).look_ns

    sees(pursuer, 12, (0.5, 0.2))

    assert calm > 14 * STEP_NS
    assert pursuer.step(12 * STEP_NS, OWN).look_ns == 13 * STEP_NS


@pytest.mark.parametrize(("seen_ns", "place", "words"), [
    (9 * STEP_NS, (0.0, 0.0), "it is from the future"), (6 * STEP_NS, (nan, 0.0), "expected finite numbers"),
    (5 * STEP_NS, (0.0, 0.0), "with this time stamp already")])
def test_a_detection_that_cannot_be_is_refused_and_changes_nothing(pursuer, seen_ns, place, words):
    sees(pursuer, 5, (1.3, 0.0))
    before = pursuer.step(8 * STEP_NS, OWN)

    with pytest.raises(ValueError, match=words):
        pursuer.detected(8 * STEP_NS, seen_ns, place, OWN)

    assert pursuer.step(8 * STEP_NS, OWN) == before


def test_the_example_of_the_page_works():
    page = (Path(__file__).parents[3] / "docs" / "models" / "pursuit.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names = {"adaptive_pursuer": adaptive_pursuer, "CircleFilter": CircleFilter, "Zones": Zones,
             "PursuitLaw": PursuitLaw, "now_ns": 0, "seen_ns": 0, "own": OWN, "place": (1.3, 0.0)}

    exec(example, names)

    assert names["pursuer"].step(0, OWN).velocity_mps == (1.3, 0.0)


def test_zones_that_are_not_sure_are_refused_unless_asked_for():
    zones = Zones(2.3, 1.15, 0.147)
    known = {"v_max_mps": 0.7, "sigma_m": 0.1, "step_ns": STEP_NS, "rho_m": 0.2}

    with pytest.raises(ValueError, match=r"escape_m=0.147.*take 0.548 m or more"):
        adaptive_pursuer(CircleFilter(3), zones, PursuitLaw(), **known)

    assert adaptive_pursuer(CircleFilter(3), zones, PursuitLaw(), **known, sure=False).zones is zones


def test_a_latency_needs_a_wider_escape_area():
    with pytest.raises(ValueError, match=r"escape_m=0.55.*take 0.695 m or more"):
        make(latency_ns=3 * STEP_NS)
