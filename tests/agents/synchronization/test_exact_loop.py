import numpy as np
import pytest
import scipy.linalg

from agents.synchronization.closed_loop import ClosedLoop, LinearAgent
from agents.synchronization.exact_loop import ExactLoop, links_with_a_value, stability_limit
from agents.synchronization.graph import edges, laplacian
from agents.synchronization.partition import partition
from agents.synchronization.round_plan import RoundPlan, plan_round
from tests.agents.synchronization.exact_run import Hearing, simulate

SCAN_STEP_S, SCAN_END_S = 1e-4, 0.02


@pytest.fixture(scope="module")
def loops(five_agents, l1, l2):
    return [ExactLoop(five_agents, L, partition(L)) for L in (l1, l2)]


def state_after(agents, plan, slots, x0, delay_ns=0):
    """x after a number of slots by the simulation, which shares no map with ExactLoop."""
    run = simulate(agents, [plan], lambda _: 0, slots * plan.slot_ns, [slots * plan.slot_ns], x0=x0, delay_ns=delay_ns)
    return run.states[-1]


@pytest.mark.parametrize("delay_ns", [0, 400_000])
def test_powers_of_the_round_map_are_the_simulation(five_agents, loops, delay_ns):
    rng = np.random.default_rng(7)
    for loop in loops:
        plan = RoundPlan(loop.laplacian, loop.parts, 1_234_567)
        x0 = rng.normal(size=10)
        z = np.concatenate([x0, loop.closed_loop.C_cl @ x0])

        M = loop.round_map(plan.slot_ns * 1e-9, delay_ns * 1e-9)
        after = np.linalg.matrix_power(M, 40) @ z

        expected = state_after(five_agents, plan, 120, x0, delay_ns)
        np.testing.assert_allclose(after[:10], expected, rtol=1e-9, atol=1e-11)


def test_an_integrator_that_follows_a_leader_has_the_limit_of_the_hand_calculation():
    """x' = -k (x^ - x^_leader), sampled every tau: x+ = (1 - k tau) x once the leader has decayed, so tau < 2 / k."""
    k = 4.0
    follower = LinearAgent([[0.0]], [[1.0]], [[1.0]], [[k]])
    leader = LinearAgent([[-1.0]], [[1.0]], [[1.0]], [[1.0]])
    loop = ExactLoop((leader, follower), laplacian(2, [(0, 1)]), ((0, 1),))

    limit = stability_limit(loop, 1e-3, 1.0)

    assert limit.stable_s == pytest.approx(2 / k, rel=1e-9)
    assert limit.stable_s < limit.unstable_s <= limit.stable_s + 1e-12


@pytest.mark.parametrize(("number", "expected_s"), [(0, 9.8366e-3), (1, 1.13346e-2)])
def test_the_exact_limits_of_the_slot_length(loops, number, expected_s):
    limit = stability_limit(loops[number], SCAN_STEP_S, SCAN_END_S)

    assert limit.stable_s == pytest.approx(expected_s, rel=5e-6)
    assert loops[number].spectral_radius(limit.stable_s) < 1 <= loops[number].spectral_radius(limit.unstable_s)


@pytest.mark.parametrize("number", [0, 1])
def test_the_simulation_converges_just_below_the_limit_and_diverges_just_above(five_agents, loops, number):
    loop = loops[number]
    limit_ns = stability_limit(loop, SCAN_STEP_S, SCAN_END_S).stable_s * 1e9
    x0 = np.random.default_rng(8).normal(size=10)

    def growth(factor):
        """Largest |x| in the last quarter of 1500 rounds over that in the quarter before: the slowest mode."""
        plan = RoundPlan(loop.laplacian, loop.parts, int(limit_ns * factor))
        rounds = 1500
        run = simulate(five_agents, [plan], lambda _: 0, rounds * plan.round_ns,
                       [k * plan.round_ns for k in range(rounds // 2, rounds)], x0=x0)
        norms = np.linalg.norm(run.states, axis=1)
        return norms[rounds // 4:].max() / norms[:rounds // 4].max()

    assert growth(0.98) < 0.99
    assert growth(1.02) > 1.01


def test_the_certified_slots_are_far_inside(five_agents, loops):
    for loop, radius in zip(loops, (0.998273, 0.999440), strict=True):
        tau_s = plan_round(five_agents, loop.laplacian).slot_ns * 1e-9

        assert loop.spectral_radius(tau_s) == pytest.approx(radius, abs=1e-6)


def test_short_rounds_approach_the_continuous_closed_loop(loops):
    for loop in loops:
        tau_s = 1e-7
        slow = np.exp(loop.closed_loop.rightmost_eigenvalue.real * 3 * tau_s)

        assert 1 - loop.spectral_radius(tau_s) == pytest.approx(1 - slow, rel=1e-3)  # error of order tau norm(A)


def test_a_scan_without_a_limit_says_so_and_an_unstable_start_is_an_error(loops, five_agents, l1):
    assert stability_limit(loops[0], 1e-4, 5e-3) is None
    with pytest.raises(ValueError, match=r"unstable already at tau = 0\.012 s"):
        stability_limit(loops[0], 0.012, 0.02)
    with pytest.raises(ValueError, match="expected 0 <= delay < tau_s"):
        loops[0].slot_map(0, 1e-3, 1e-3)


def test_a_limit_finer_than_floating_point_is_found_all_the_same(loops):
    limit = stability_limit(loops[0], SCAN_STEP_S, SCAN_END_S, accuracy_s=0.0)

    assert np.nextafter(limit.stable_s, 1) == limit.unstable_s


def test_a_delay_of_almost_nothing_changes_almost_nothing(loops):
    for loop in loops:
        M, delayed = loop.round_map(1e-3), loop.round_map(1e-3, 1e-12)

        assert np.abs(M - delayed).max() < 1e-9     # 1 ps against time constants above 10 ms, entries up to 10


def test_links_of_the_old_topology_act_at_once_and_new_ones_from_their_senders_slot(l1, l2):
    new = set(edges(l1)) - set(edges(l2))

    assert new == {(3, 0), (1, 3)}
    assert set(edges(links_with_a_value(l1, l2, []))) == set(edges(l1)) - new
    assert set(edges(links_with_a_value(l1, l2, [0, 2, 1, 4]))) == set(edges(l1)) - {(3, 0)}
    assert np.array_equal(links_with_a_value(l1, l2, range(5)), l1)


@pytest.mark.parametrize("delay_ns", [0, 300_000])
def test_the_first_round_after_a_switch_is_the_simulation_of_neighbours_only(five_agents, l1, l2, delay_ns):
    plans = [plan_round(five_agents, l2), plan_round(five_agents, l1)]
    loops = [ExactLoop(five_agents, plan.laplacian, plan.parts) for plan in plans]
    x0 = np.random.default_rng(9).normal(size=10)
    z = np.concatenate([x0, loops[0].closed_loop.C_cl @ x0])
    switch_ns, end_ns = plans[0].round_ns, plans[0].round_ns + plans[1].round_ns

    delay_s = delay_ns * 1e-9
    before = loops[0].round_map(plans[0].slot_ns * 1e-9, delay_s) @ z
    first = loops[1].round_map(plans[1].slot_ns * 1e-9, delay_s, previous=l2) @ before
    run = simulate(five_agents, plans, lambda t_ns: int(t_ns >= switch_ns), end_ns, [end_ns], x0=x0,
                   hearing=Hearing.NEIGHBOURS, delay_ns=delay_ns)

    np.testing.assert_allclose(run.states[-1], first[:10], rtol=1e-10, atol=1e-12)
    ordinary = loops[1].round_map(plans[1].slot_ns * 1e-9, delay_s) @ before
    assert np.abs(ordinary - first).max() > 1e-3


def test_agents_with_two_outputs_are_simulated_as_their_round_map_says():
    rng = np.random.default_rng(15)
    agents = tuple(LinearAgent(rng.normal(size=(n, n)), rng.normal(size=(n, 1)), rng.normal(size=(2, n)),
                               rng.normal(size=(1, 2))) for n in (2, 3, 1))
    L = laplacian(3, [(0, 1), (1, 2), (2, 0)])
    plan = RoundPlan(L, partition(L), 3_000_000)
    loop, x0 = ExactLoop(agents, L, plan.parts), rng.normal(size=6)
    z = np.concatenate([x0, loop.closed_loop.C_cl @ x0])

    after = np.linalg.matrix_power(loop.round_map(3e-3, 1e-3), 10) @ z

    slots = 10 * len(plan.parts)
    np.testing.assert_allclose(after[:6], state_after(agents, plan, slots, x0, 1_000_000), rtol=1e-9, atol=1e-11)


def test_outputs_of_several_components_are_sampled_together():
    rng = np.random.default_rng(10)
    agents = tuple(LinearAgent(rng.normal(size=(3, 3)), rng.normal(size=(3, 2)), rng.normal(size=(2, 3)), np.eye(2))
                   for _ in range(2))
    L = laplacian(2, [(0, 1), (1, 0)])
    loop, tau_s = ClosedLoop(agents, L), 0.05

    M = ExactLoop(agents, L, ((0, 1),)).round_map(tau_s)

    grown = scipy.linalg.expm(np.block([[loop.A_open, loop.B_cl], [np.zeros((4, 10))]]) * tau_s)
    np.testing.assert_allclose(M[:6, :6], grown[:6, :6] + grown[:6, 6:] @ loop.C_cl, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(M[6:, :6], loop.C_cl, rtol=1e-12)
    assert not M[:, 6:].any()
