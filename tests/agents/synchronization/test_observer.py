from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.signal import place_poles

from agents.synchronization.closed_loop import LinearAgent
from agents.synchronization.observer import (
    Observer,
    hidden_eigenvalues,
    observable_basis,
    observer_gain,
    pole_problems,
)

H_S = 3.254478e-3


def poles_of(agent, base=-8.0):
    return [base * (1 + 0.3 * k) for k in range(observable_basis(agent).shape[1])]


def test_the_gain_is_that_of_scipy_for_agents_whose_output_shows_all_states(five_agents):
    for agent in five_agents[:4]:
        poles, F = poles_of(agent), expm(agent.A * H_S)

        L = observer_gain(agent, poles, H_S)

        theirs = place_poles(F.T, agent.C.T, np.exp(np.array(poles) * H_S)).gain_matrix.T   # F - theirs C
        np.testing.assert_allclose(F @ L, theirs, rtol=1e-7)


def test_agent_5_shows_one_state_and_keeps_its_hidden_eigenvalues(five_agents):
    """C A = 2 C: the output is the mode of the eigenvalue 2 alone."""
    agent = five_agents[4]
    np.testing.assert_array_equal(agent.C @ agent.A, 2 * agent.C)

    L = observer_gain(agent, [-8.0], H_S)

    reached = np.sort_complex(np.linalg.eigvals((np.eye(3) - L @ agent.C) @ expm(agent.A * H_S)))
    expected = np.sort_complex(np.exp(np.array([-8.0, -1 + 1j, -1 - 1j]) * H_S))
    np.testing.assert_allclose(reached, expected, atol=1e-13)
    np.testing.assert_allclose(np.sort_complex(hidden_eigenvalues(agent)), [-1 - 1j, -1 + 1j], atol=1e-13)


@given(st.integers(0, 2**32 - 1))
def test_poles_are_placed_with_several_outputs_too(seed):
    rng = np.random.default_rng(seed)
    agent = LinearAgent(rng.normal(size=(4, 4)), np.eye(4), rng.normal(size=(2, 4)), np.zeros((4, 2)))
    poles = [-3.0, -6.0, -9.0, -13.0]

    try:
        L = observer_gain(agent, poles, 0.1)
    except ValueError:          # a pole near an eigenvalue of A
        return

    reached = np.linalg.eigvals((np.eye(4) - L @ agent.C) @ expm(agent.A * 0.1))
    np.testing.assert_allclose(np.sort(reached.real), np.sort(np.exp(np.array(poles) * 0.1)), atol=1e-6)


def test_beside_an_integrated_plant_its_error_depends_on_itself_alone_and_has_the_poles(five_agents):
    agent, h_s = five_agents[3], 0.01
    observer = Observer(agent, [-8.0, -11.0], [0.0, 0.0], 0)
    observer.expect_corrections_every(10_000_000)
    kept = (np.eye(2) - observer_gain(agent, [-8.0, -11.0], h_s) @ agent.C) @ expm(agent.A * h_s)
    x, errors, expected = np.array([1.0, 1.0]), [], []
    for k in range(60):
        u = [np.sin(k)]
        observer.correct(k * 10_000_000, agent.C @ x)
        observer.set_input(k * 10_000_000, u)
        errors.append(observer.estimate - x)
        expected.append(kept @ expected[-1] if expected else errors[0])
        x = solve_ivp(lambda t, y, u=u: agent.A @ y + agent.B @ u, (0, h_s), x, rtol=1e-12, atol=1e-14).y[:, -1]
        ahead = agent.C @ (x + expm(agent.A * h_s) @ errors[-1])
        np.testing.assert_allclose(observer.output_at((k + 1) * 10_000_000), ahead, atol=1e-10)

    np.testing.assert_allclose(errors, expected, atol=1e-10)
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(kept)), np.exp([-0.11, -0.08]), rtol=1e-10)


@pytest.mark.parametrize(("poles", "said"), [
    ([-1.0], "expected 2, a pole for each of the 2 states"), ([-1.0, 1.0], "expected negative numbers"),
    ([-5.0, -5.0], "expected different poles"), ([-5.0, float("nan")], "expected negative numbers")])
def test_poles_that_cannot_be_are_named(five_agents, poles, said):
    assert any(said in problem for problem in pole_problems(five_agents[0], poles))


def test_an_unstable_mode_that_no_output_shows_is_refused():
    agent = LinearAgent([[1.0, 0.0], [0.0, -1.0]], [[1.0], [1.0]], [[0.0, 1.0]], [[1.0]])

    problem, = pole_problems(agent, [-5.0])

    assert "(A, C) is not detectable: no output shows the eigenvalues 1, expected real parts below 0" in problem


def test_poles_too_near_to_each_other_are_refused_with_the_remedy(five_agents):
    with pytest.raises(ValueError, match=r"no gain places them with a measurement every 0\.01 s; .* further apart"):
        observer_gain(five_agents[0], [-5.0, -5.0 - 1e-13], 0.01)
