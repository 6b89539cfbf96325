import numpy as np
import pytest

from agents.synchronization.closed_loop import ClosedLoop, LinearAgent
from agents.synchronization.graph import GraphError, laplacian, neighbours


def control(agents, L, outputs, bias):
    """(6.6) as it stands, agent by agent."""
    return [-agent.K @ sum(((outputs[i] - outputs[j]) - (bias[i] - bias[j]) for j in heard), np.zeros(agent.outputs))
            for i, (agent, heard) in enumerate(zip(agents, neighbours(L), strict=True))]


def test_the_stacked_matrices_are_the_control_law_written_out(five_agents, l1):
    rng = np.random.default_rng(1)
    states = [rng.normal(size=agent.states) for agent in five_agents]
    bias = rng.normal(size=(5, 1))
    omega = [rng.normal(size=agent.inputs) for agent in five_agents]
    outputs = [agent.C @ x for agent, x in zip(five_agents, states, strict=True)]

    u = control(five_agents, l1, outputs, bias)
    expected = np.concatenate([agent.A @ x + agent.B @ (u_i + w)
                               for agent, x, u_i, w in zip(five_agents, states, u, omega, strict=True)])
    loop = ClosedLoop(five_agents, l1)
    x = np.concatenate(states)

    found = loop.A_cl @ x - loop.B_cl @ bias.reshape(-1) + loop.B_d @ np.concatenate(omega)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(loop.C_cl @ x, np.concatenate(outputs), rtol=1e-15)


def test_agents_with_two_outputs_and_two_inputs_stack_in_the_same_way():
    rng = np.random.default_rng(2)
    agents = [LinearAgent(rng.normal(size=(n, n)), rng.normal(size=(n, m)), rng.normal(size=(2, n)),
                          rng.normal(size=(m, 2))) for n, m in ((3, 1), (2, 2), (4, 3))]
    L = laplacian(3, [(0, 1), (1, 2), (2, 0), (2, 1)])
    states = [rng.normal(size=agent.states) for agent in agents]

    u = control(agents, L, [a.C @ x for a, x in zip(agents, states, strict=True)], np.zeros((3, 2)))
    expected = np.concatenate([a.A @ x + a.B @ u_i for a, x, u_i in zip(agents, states, u, strict=True)])

    np.testing.assert_allclose(ClosedLoop(agents, L).A_cl @ np.concatenate(states), expected, rtol=1e-12, atol=1e-12)


def test_both_printed_topologies_are_hurwitz(loop1, loop2):
    assert loop1.rightmost_eigenvalue.real < 0
    assert loop2.rightmost_eigenvalue.real < 0
    assert loop1.rightmost_eigenvalue.real == pytest.approx(-0.557336, abs=1e-6)
    assert loop2.rightmost_eigenvalue.real == pytest.approx(-0.234012, abs=1e-6)


def test_condition_i_of_remark_13_fails_for_agent_3_as_printed_and_for_no_other(loop1, loop2):
    for loop in (loop1, loop2):
        first = [problem for problem in loop.remark_13_problems() if problem.startswith("Remark 13 (i),")]

        assert len(first) == 1
        assert "agent 2: A_i - l_ii B_i K_i C_i has the eigenvalue 1.5" in first[0]     # agent 3 of the dissertation


def test_remark_13_is_sufficient():
    """Whenever both conditions hold, A_cl is Hurwitz; random teams of two, of which enough satisfy them."""
    rng, satisfied = np.random.default_rng(3), 0
    L = laplacian(2, [(0, 1), (1, 0)])
    for _ in range(400):
        agents = [LinearAgent(np.diag(-rng.uniform(0.1, 4, 2)), rng.normal(size=(2, 1)), rng.normal(size=(1, 2)),
                              [[rng.uniform(-0.5, 0.5)]]) for _ in range(2)]
        loop = ClosedLoop(agents, L)
        if not loop.remark_13_problems():
            satisfied += 1
            assert loop.rightmost_eigenvalue.real < 0
    assert satisfied > 50


def test_the_equilibrium_for_a_bias_stays_where_it_is_and_is_reached(loop1):
    d = np.array([1.0, -2.0, 0.5, 0.0, 3.0])

    x_eq = loop1.equilibrium(d)

    np.testing.assert_allclose(loop1.A_cl @ x_eq, loop1.B_cl @ d, rtol=1e-9)
    assert not loop1.equilibrium(np.zeros(5)).any()


def test_the_same_bias_for_all_changes_nothing(loop1):
    assert np.abs(loop1.equilibrium(np.full(5, 7.0))).max() < 1e-9


@pytest.mark.parametrize(("matrices", "said"), [
    (([[1, 2]], [[1]], [[1]], [[1]]), "A is 1 x 2: expected 1 x 1"),
    (([[1]], [[1], [1]], [[1]], [[1]]), "B is 2 x 1: expected 1 x 1"),
    (([[1]], [[1]], [[1, 1]], [[1]]), "C is 1 x 2: expected 1 x 1"),
    (([[1]], [[1]], [[1]], [[1, 1]]), "K is 1 x 2: expected 1 x 1"),
    (([[1]], [[1]], [[1]], 2), r"K has shape \(\): expected a matrix"),
    (([[float("inf")]], [[1]], [[1]], [[1]]), "A holds inf: expected finite numbers"),
])
def test_matrices_that_do_not_fit_are_named(matrices, said):
    with pytest.raises(ValueError, match=said):
        LinearAgent(*matrices)


def test_a_team_that_does_not_fit_its_graph_is_refused(five_agents, l1):
    two_outputs = LinearAgent([[1]], [[1]], [[1], [1]], [[1, 1]])

    with pytest.raises(ValueError, match="4 agents and a Laplacian of 5"):
        ClosedLoop(five_agents[:4], l1)
    with pytest.raises(ValueError, match="all need the same number"):
        ClosedLoop((two_outputs, *five_agents[1:]), l1)
    with pytest.raises(GraphError, match=r"l\[0\]\[0\]"):
        ClosedLoop(five_agents, l1 + np.eye(5))
    with pytest.raises(ValueError, match="the bias has 2 entries: expected 5"):
        ClosedLoop(five_agents, l1).equilibrium([1, 2])
