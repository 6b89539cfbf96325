from __future__ import annotations

from math import sqrt

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import expm

from agents.synchronization.exact_loop import spectral_radius
from agents.synchronization.noise_bounds import BiasBound, _response, largest_outputs, standard_deviations
from agents.synchronization.observed_loop import ObservedLoop, broadcast_noise
from agents.synchronization.partition import partition
from agents.synchronization.round_plan import plan_round

POLES = [[-5.0, -6.0], [-5.0], [-5.0, -6.0], [-5.0, -6.0], [-5.0]]


@pytest.fixture(scope="module")
def team(five_agents, l1):
    plan = plan_round(five_agents, l1)
    loop = ObservedLoop(five_agents, l1, partition(l1), POLES)
    return loop, plan.slot_ns * 1e-9, loop.round_maps(plan.slot_ns * 1e-9)


def test_a_response_has_the_norm_that_a_quadrature_gives(loop1):
    x0 = np.random.default_rng(3).normal(size=10)

    squared, _ = quad(lambda t: float(np.sum((loop1.C_cl @ expm(loop1.A_cl * t) @ x0) ** 2)), 0, 40, limit=400)

    assert _response(loop1.A_cl, loop1.C_cl, x0) == pytest.approx(sqrt(squared), rel=1e-6)


def test_many_noises_have_the_standard_deviations_of_the_map(team):
    loop, _, (M, N) = team
    rng, z, total, rounds = np.random.default_rng(4), np.zeros(len(M)), np.zeros(5), 60_000

    for nu in rng.choice([-1.0, 1.0], size=(rounds, 5)):
        z = M @ z + N @ nu
        total += (loop.outputs @ z) ** 2

    independent = rounds * (1 - spectral_radius(M))         # outputs are correlated over 1 / (1 - radius) rounds
    expected = standard_deviations(M, N, loop.outputs)
    np.testing.assert_allclose(np.sqrt(total / rounds), expected, rtol=4 / sqrt(independent))


def test_the_largest_output_is_reached_by_the_worst_noises_and_by_no_random_ones(team):
    loop, _, (M, N) = team
    bound = largest_outputs(M, N, loop.outputs)
    rounds = 6000
    rows = [loop.outputs[0]]
    for _ in range(rounds - 1):
        rows.append(rows[-1] @ M)

    def last_output(noises):
        z = np.zeros(len(M))
        for nu in noises:
            z = M @ z + N @ nu
        return abs(float(loop.outputs[0] @ z))

    assert last_output(np.sign(np.array(rows[::-1]) @ N)) == pytest.approx(bound[0], rel=1e-3)
    assert last_output(np.random.default_rng(5).uniform(-1, 1, (rounds, 5))) < bound[0] / 10


@pytest.mark.parametrize("noise", ["worst in phase", "random"])
def test_the_outputs_stay_below_the_bound_in_l2_from_any_start(five_agents, loop1, team, noise):
    """Sampled at the starts of rounds, 3.25 ms apart, which the fastest mode, 0.1 s, hardly changes in between."""
    loop, tau_s, (M, N) = team
    errors = [broadcast_noise(agent, poles, 3 * tau_s) for agent, poles in zip(five_agents, POLES, strict=True)]
    bound, rng = BiasBound(loop1, 3, tau_s), np.random.default_rng(6)
    x0, rounds = rng.normal(size=10), 1200
    z, squared = loop.start(x0, x0), 0.0

    for k in range(rounds):
        nu = np.ones(5) * (1 if k // 300 % 2 else -1) if noise == "worst in phase" else rng.uniform(-1, 1, 5)
        squared += float(np.sum((loop.outputs @ z) ** 2)) * 3 * tau_s
        z = M @ z + N @ nu

    assert sqrt(squared) < bound.of_outputs(x0, sqrt(sum(e * e for e in errors)), rounds * 3 * tau_s)


def test_the_printed_bias_is_thousands_of_times_ours_and_needs_certified_slots(loop1, team):
    bound = BiasBound(loop1, 3, team[1])

    assert bound.printed_gain / bound.gain > 1000
    assert BiasBound(loop1, 3, 4e-3).printed_gain == float("inf")
    with pytest.raises(ValueError, match=r"kappa = 2 T tau g / pi is 1\.09\d*, expected below 1; shorten the slots"):
        BiasBound(loop1, 3, 5e-3)
