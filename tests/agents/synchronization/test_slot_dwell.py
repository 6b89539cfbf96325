"""A dwell of two slots suffices for the five agents, one slot does not (section 6.5, Remark 18)."""

from math import exp

import numpy as np
import pytest
import scipy.linalg

from agents.synchronization.closed_loop import LinearAgent
from agents.synchronization.exact_loop import spectral_radius
from agents.synchronization.graph import laplacian
from agents.synchronization.round_plan import RoundPlan, plan_round
from agents.synchronization.slot_dwell import SlotDwellCertificate, slot_dwell_certificate, stay_steps
from agents.synchronization.starving import signal_map, starving_signal


@pytest.fixture(scope="module")
def plans(five_agents, l1, l2):
    return [plan_round(five_agents, l1), plan_round(five_agents, l2)]


@pytest.fixture(scope="module")
def pair():
    """Two agents x' = -x + u that hear each other, in rounds of both orders."""
    agents = [LinearAgent([[-1.0]], [[1.0]], [[1.0]], [[0.1]])] * 2
    links = laplacian(2, [(0, 1), (1, 0)])
    return agents, [RoundPlan(links, parts, 1_000_000) for parts in (((0,), (1,)), ((1,), (0,)))]


@pytest.mark.parametrize("dwell", [1, 2, 3])
def test_a_stay_s_map_is_that_of_the_signal(five_agents, plans, dwell):
    """From phase 0 a stay of n slots in topology p is the signal p, p, ..., p."""
    steps = stay_steps(five_agents, plans, dwell)

    from_0 = [step for step in steps if step.before == 0]
    expected = [(p, n) for p in (0, 1) for n in range(dwell, 2 * dwell)]
    assert len(steps) == 6 * dwell
    for step, (p, n) in zip(from_0, expected, strict=True):
        np.testing.assert_allclose(step.M, signal_map(five_agents, plans, [p] * n), rtol=1e-12, atol=1e-14)
        assert step.after == n % 3
        assert step.duration_s == pytest.approx(n * plans[p].slot_ns * 1e-9)


def test_no_signal_of_stays_of_two_slots_starves_an_agent(plans):
    """Why two slots can do: in any six slots every agent broadcasts. Brute force over stays of 2 and 3 slots."""
    def stays(length):
        if length <= 0:
            yield []
            return
        for p in (0, 1):
            for n in (2, 3):
                for rest in stays(length - n):
                    yield [p] * n + rest

    for phase in range(3):
        for signal in stays(6):
            spoken = {agent for k, p in enumerate(signal[:6]) for agent in plans[p].parts[(phase + k) % 3]}
            assert spoken == set(range(5))
    assert starving_signal(plans, 4) == (0, 1, 0)       # stays of one slot and two: 0 1 0, 0 1 0, ...


def test_a_pair_is_certified_near_the_rate_of_its_mean(pair):
    certificate = slot_dwell_certificate(*pair, dwell_slots=2)

    assert certificate.problems() == []
    assert certificate.rate_per_s == pytest.approx(1.0, rel=0.05)
    assert {step.before for step in certificate.steps} == {0, 1}


def test_a_certificate_that_claims_too_much_fails_its_own_check(pair):
    found = slot_dwell_certificate(*pair, dwell_slots=2)

    faster = SlotDwellCertificate(found.steps, found.P, found.rate_per_s * 1.1)
    growing = SlotDwellCertificate(found.steps, found.P, -0.1)

    assert faster.problems()[0].startswith("phase ")
    assert growing.problems() == ["the rate is -0.1 per second: expected above 0"]


def test_plans_of_unequal_length_and_no_dwell_are_refused(pair, plans, five_agents):
    two_parts = RoundPlan(laplacian(5, []), ((0, 1, 2), (3, 4)), 1000)

    with pytest.raises(ValueError, match=r"plans with \[2, 3\] parts"):
        stay_steps(five_agents, [plans[0], two_parts], 2)
    with pytest.raises(ValueError, match="dwell_slots=0"):
        stay_steps(*pair, 0)


@pytest.fixture(scope="module")
def two_slots(five_agents, plans):
    return slot_dwell_certificate(five_agents, plans, 2)


@pytest.mark.slow       # 10 s: the search over three functions of 15 variables
def test_two_slots_are_certified_by_a_function_for_each_phase(two_slots):
    assert two_slots.problems() == []
    assert two_slots.rate_per_s == pytest.approx(0.1443, abs=3e-4)
    for step in two_slots.steps:
        grown = scipy.linalg.eigh(step.M.T @ two_slots.P[step.after] @ step.M, two_slots.P[step.before],
                                  eigvals_only=True)[-1]
        assert grown < exp(-2 * two_slots.rate_per_s * step.duration_s)


@pytest.mark.slow
def test_random_signals_of_that_dwell_stay_below_the_certified_decay(two_slots, five_agents, plans):
    steps = {}
    for step in two_slots.steps:
        steps.setdefault(step.before, []).append(step)
    rng = np.random.default_rng(5)
    for _ in range(5):
        z, t_s, phase = rng.normal(size=15), 0.0, 0
        start = np.linalg.norm(z)
        for _ in range(4000):
            step = steps[phase][int(rng.integers(len(steps[phase])))]
            z, t_s, phase = step.M @ z, t_s + step.duration_s, step.after
            assert np.linalg.norm(z) <= two_slots.overshoot * exp(-two_slots.rate_per_s * t_s) * start


@pytest.mark.slow
def test_one_slot_has_no_certificate_and_a_signal_that_diverges(five_agents, plans):
    assert not slot_dwell_certificate(five_agents, plans, 1).holds
    assert spectral_radius(signal_map(five_agents, plans, starving_signal(plans, 4))) > 1.005
