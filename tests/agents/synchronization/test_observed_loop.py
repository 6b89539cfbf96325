from __future__ import annotations

import numpy as np
import pytest

from agents.synchronization.exact_loop import ExactLoop, stability_limit
from agents.synchronization.observed_loop import ObservedLoop, broadcast_errors, broadcast_noise
from agents.synchronization.observer import Observer, hidden_eigenvalues, observable_basis
from agents.synchronization.partition import partition

POLES = [[-8.0, -10.0], [-8.0], [-8.0, -10.0], [-8.0, -10.0], [-8.0]]


@pytest.fixture(scope="module")
def loops(five_agents, l1, l2):
    return [ObservedLoop(five_agents, L, partition(L), POLES) for L in (l1, l2)]


def nearest(values, wanted):
    """The largest distance of an entry of `wanted` to an entry of `values`, each used once."""
    left, worst = list(values), 0.0
    for value in wanted:
        near = min(left, key=lambda other: abs(other - value))
        left.remove(near)
        worst = max(worst, abs(near - value))
    assert not left
    return worst


@pytest.mark.parametrize("delay_ns", [0, 400_000])
@pytest.mark.parametrize("tau_s", [1.084826e-3, 9e-3])
def test_the_spectrum_is_that_of_the_loop_together_with_that_of_the_observers(five_agents, loops, tau_s, delay_ns):
    for loop in loops:
        delay_s, round_s = delay_ns * 1e-9, 3 * tau_s
        M, _ = loop.round_maps(tau_s, delay_s)

        own = np.linalg.eigvals(ExactLoop(five_agents, loop.laplacian, loop.parts).round_map(tau_s, delay_s))
        placed = np.exp(np.concatenate(POLES) * round_s)
        hidden = np.exp(np.concatenate([hidden_eigenvalues(agent) for agent in five_agents]) * round_s)
        assert nearest(np.linalg.eigvals(M), [*own, *placed, *hidden]) < 1e-9


def test_the_limit_of_the_slot_length_is_unchanged(loops):
    for loop, expected_s in zip(loops, (9.8366e-3, 1.13346e-2), strict=True):
        assert stability_limit(loop, 1e-4, 0.02).stable_s == pytest.approx(expected_s, rel=5e-6)


@pytest.mark.parametrize("delay_ns", [0, 300_000])
def test_powers_of_the_round_map_are_observers_beside_simulated_agents(five_agents, loops, delay_ns):
    """Event by event, with the observers that the robots run: no map of a slot or round."""
    from tests.agents.synchronization.observed_run import simulate_observed

    rng, slot_ns = np.random.default_rng(5), 1_234_567
    x0, xh0 = rng.normal(size=10), rng.normal(size=10)
    noises = rng.uniform(-1, 1, size=(20, 5))
    for loop in loops:
        M, N = loop.round_maps(slot_ns * 1e-9, delay_ns * 1e-9)
        z = loop.start(x0, xh0)
        for nu in noises:
            z = M @ z + N @ nu

        x, xh = simulate_observed(five_agents, loop.laplacian, loop.parts, POLES, slot_ns, delay_ns, x0, xh0, noises)

        np.testing.assert_allclose(loop.states_of(z)[0], x, rtol=1e-9, atol=1e-10)
        np.testing.assert_allclose(loop.states_of(z)[1], xh, rtol=1e-9, atol=1e-10)


def errors_of_broadcasts(agent, poles, h_ns, eps0, noises):
    """e_o right after each correction of an observer of the agent at rest, which starts eps0 off."""
    observer = Observer(agent, poles, list(eps0), 0)
    observer.expect_corrections_every(h_ns)
    errors = []
    for k, nu in enumerate(noises):
        observer.correct(k * h_ns, nu)
        errors.append(np.linalg.norm(agent.C @ observer.estimate))
    return errors


def test_the_sum_of_the_errors_is_at_most_k_times_the_first(five_agents):
    """(4.24), and K is no more than twice what some start needs."""
    h_ns = 3_254_478
    for agent, poles in zip(five_agents, POLES, strict=True):
        K = broadcast_errors(agent, poles, h_ns * 1e-9)
        starts = [*np.random.default_rng(1).normal(size=(8, agent.states)), agent.C[0]]

        ratios = [sum(errors_of_broadcasts(agent, poles, h_ns, eps0, np.zeros((500, 1)))) / np.linalg.norm(eps0)
                  for eps0 in starts]

        assert K / 2 < max(ratios) <= K * (1 + 1e-9)


def test_with_the_error_of_the_output_on_the_right_4_24_fails(five_agents):
    """Remark 6 read literally: eps(0) in the null space of C gives e_o(0) = 0, and later errors all the same."""
    agent = five_agents[2]
    eps0 = np.array([1.0, -1.0])
    assert np.linalg.norm(agent.C @ eps0) == 0

    assert max(errors_of_broadcasts(agent, POLES[2], 3_254_478, eps0, np.zeros((50, 1)))) > 0.02


def test_bounded_noise_gives_errors_below_the_bound_which_a_worst_noise_attains(five_agents):
    h_ns = 3_254_478
    for agent, poles in zip(five_agents, POLES, strict=True):
        bound, still = broadcast_noise(agent, poles, h_ns * 1e-9), np.zeros(agent.states)

        random = errors_of_broadcasts(agent, poles, h_ns, still, np.random.default_rng(2).uniform(-1, 1, (800, 1)))
        single = errors_of_broadcasts(agent, poles, h_ns, still, [[1.0], *np.zeros((800, 1))])

        assert max(random) <= bound
        assert sum(single) == pytest.approx(bound, rel=1e-6)       # the response to one noise, summed: worst signs
        assert observable_basis(agent).shape[1] == len(poles)
