import numpy as np
import pytest
import scipy.integrate

from agents.synchronization.round_plan import RoundPlan, plan_round
from tests.agents.synchronization.exact_run import Hearing, alternating, simulate

REFERENCE_DISTURBANCE = ((0, 5.0), (4_400_000_000, -5.0), (8_800_000_000, 0.0))


@pytest.fixture(scope="module")
def plans(five_agents, l1, l2):
    return [plan_round(five_agents, l1), plan_round(five_agents, l2)]


def integrated(agents, plans, requested, length_ns, disturbance, delay_ns=0):
    """The same run retold with a general integrator and one agent after the other: x at the end."""
    x = [np.ones(agent.states) for agent in agents]
    held = [agent.C @ x_i for agent, x_i in zip(agents, x, strict=True)]
    pending, now_ns, slot, plan = [], 0, 0, None
    next_slot_ns = 0
    while now_ns < length_ns:
        for due_ns, i, value in [p for p in pending if p[0] == now_ns]:
            held[i] = value
            pending.remove((due_ns, i, value))
        if now_ns == next_slot_ns:
            if plan is None or slot == len(plan.parts):
                plan, slot = plans[requested(now_ns)], 0
            for i in plan.parts[slot]:
                value = agents[i].C @ x[i]
                if delay_ns:
                    pending.append((now_ns + delay_ns, i, value))
                else:
                    held[i] = value
            slot += 1
            next_slot_ns = now_ns + plan.slot_ns
        until_ns = min([length_ns, next_slot_ns, *(p[0] for p in pending), *(t for t, _ in disturbance if t > now_ns)])
        omega = [w for t, w in disturbance if t <= now_ns][-1] if disturbance else 0.0
        for i, agent in enumerate(agents):
            heard = [j for j in range(len(agents)) if j != i and plan.laplacian[i, j]]
            u = -agent.K @ sum(held[i] - held[j] for j in heard) + omega
            span_s = (0, (until_ns - now_ns) * 1e-9)
            x[i] = scipy.integrate.solve_ivp(lambda t, y, a=agent, u=u: a.A @ y + a.B @ u, span_s, x[i],
                                             method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        now_ns = until_ns
    return np.concatenate(x)


@pytest.mark.parametrize("delay_ns", [0, 123_456])
def test_agrees_with_a_numerical_integration_of_the_same_story(five_agents, plans, delay_ns):
    length_ns, switching = 60_000_000, alternating(20_000_000)
    disturbance = ((0, 5.0), (25_000_001, -5.0), (50_000_000, 0.0))

    run = simulate(five_agents, plans, switching, length_ns, [length_ns], disturbance=disturbance, delay_ns=delay_ns)

    expected = integrated(five_agents, plans, switching, length_ns, disturbance, delay_ns)
    np.testing.assert_allclose(run.states[-1], expected, rtol=1e-9, atol=1e-10)
    assert len(run.adoptions) == 3


def test_sampling_more_often_does_not_change_what_is_sampled(five_agents, plans):
    often = list(range(0, 30_000_001, 100_003))

    all_of_them = simulate(five_agents, plans, alternating(10_000_000), 30_000_000, often).outputs
    every_seventh = simulate(five_agents, plans, alternating(10_000_000), 30_000_000, often[::7]).outputs

    np.testing.assert_array_equal(all_of_them[::7], every_seventh)


def test_samples_at_both_ends_and_twice_at_one_instant(five_agents, plans):
    run = simulate(five_agents, plans, alternating(10_000_000), 5_000_000, [0, 0, 5_000_000, 5_000_000])

    np.testing.assert_allclose(run.outputs[0], [-3, -4, 2, -4, -3])      # C_i times ones
    np.testing.assert_array_equal(run.outputs[[0, 2]], run.outputs[[1, 3]])
    assert simulate(five_agents, plans, alternating(10_000_000), 5_000_000, []).outputs.size == 0


def test_a_request_is_adopted_at_the_next_round_end_and_rounds_are_never_cut(five_agents, plans):
    run = simulate(five_agents, plans, alternating(500_000_000), 1_600_000_000, [])

    first_end = -(-500_000_000 // plans[0].round_ns) * plans[0].round_ns
    second_end = first_end + -(-(1_000_000_000 - first_end) // plans[1].round_ns) * plans[1].round_ns
    third_end = second_end + -(-(1_500_000_000 - second_end) // plans[0].round_ns) * plans[0].round_ns
    assert run.adoptions == ((0, 0), (first_end, 1), (second_end, 0), (third_end, 1))
    before = [agent for t_ns, agent in run.broadcasts if t_ns < first_end]
    after = [(t_ns, agent) for t_ns, agent in run.broadcasts if first_end <= t_ns < first_end + plans[1].round_ns]
    assert before == [0, 2, 1, 4, 3] * (len(before) // 5)
    assert after == [(first_end + k * plans[1].slot_ns, agent)
                     for k, part in enumerate(plans[1].parts) for agent in part]


def test_a_request_exactly_at_a_round_end_is_adopted_there(five_agents, plans):
    exact = alternating(plans[0].round_ns)

    run = simulate(five_agents, plans, exact, plans[0].round_ns + 1, [])

    assert run.adoptions == ((0, 0), (plans[0].round_ns, 1))


def test_without_disturbance_the_reference_run_synchronizes(five_agents, plans):
    run = simulate(five_agents, plans, alternating(500_000_000), 13_000_000_000, [0, 6_500_000_000, 13_000_000_000])

    assert np.abs(run.outputs[0]).max() == 4.0
    assert np.abs(run.outputs[2]).max() < np.abs(run.outputs[1]).max() < 0.5
    assert np.abs(run.outputs[2]).max() < 0.05


def test_with_the_disturbance_the_outputs_settle_off_zero_and_then_decay(five_agents, plans):
    run = simulate(five_agents, plans, alternating(500_000_000), 13_000_000_000,
                   [4_400_000_000, 8_800_000_000, 10_900_000_000, 13_000_000_000], disturbance=REFERENCE_DISTURBANCE)

    peak, low, decaying, end = np.abs(run.outputs).max(axis=1)
    assert low > 5
    assert peak > 1
    assert end < decaying < low
    assert np.abs(run.outputs[1]).min() > 2


def test_the_first_round_of_a_new_link_differs_when_only_neighbours_are_heard(five_agents, plans):
    instants = [499_000_000, 700_000_000, 1_100_000_000]
    everyone, neighbours = (simulate(five_agents, plans, alternating(500_000_000), 1_200_000_000, instants, hearing=h)
                            for h in Hearing)

    differences = np.abs(everyone.outputs - neighbours.outputs).max(axis=1)
    assert differences[0] == 0.0
    assert differences[1] < 1e-12       # L2 has no link that L1 lacks
    assert 1e-6 < differences[2] < 0.1


@pytest.mark.slow
def test_the_bias_moves_the_outputs_to_the_equilibrium(five_agents, plans, loop1):
    d = np.array([0.5, -0.5, 1.0, 0.0, -1.0])

    run = simulate(five_agents, plans[:1], lambda _: 0, 40_000_000_000, [40_000_000_000], bias=d)

    expected = loop1.C_cl @ loop1.equilibrium(d)      # slowest mode: exp(-0.53 * 40) = 6e-10 of a distance below 10
    np.testing.assert_allclose(run.outputs[-1], expected, atol=1e-7)


def test_nonsense_is_refused(five_agents, plans):
    with pytest.raises(ValueError, match="expected 0 <= delay < slot_ns"):
        simulate(five_agents, plans, alternating(1000), 10, [], delay_ns=plans[1].slot_ns)
    with pytest.raises(ValueError, match="ascending instants from 0 to 10"):
        simulate(five_agents, plans, alternating(1000), 10, [3, 2])
    with pytest.raises(ValueError, match="ascending instants from 0 to 10"):
        simulate(five_agents, plans, alternating(1000), 10, [11])


def test_a_run_shorter_than_a_slot_is_one_broadcast(five_agents, l1):
    plan = RoundPlan(l1, ((0, 2), (1, 4), (3,)), 1_000_000)

    run = simulate(five_agents, [plan], lambda _: 0, 10, [10])

    assert run.broadcasts == ((0, 0), (0, 2))
