"""The test by the reflected wave against closed forms and a scan of Re G."""

from __future__ import annotations

import numpy as np
import pytest

from agents.waves.agent import Agent, read_agent
from agents.waves.passivity import violation
from tests.agents.waves.conftest import integrator, mass_damper


@pytest.mark.parametrize("b", [0.1, 1.0, 20.0])
def test_an_integrator_and_a_mass_damper_with_lead_enough_are_passive(b):
    assert violation(integrator(), b) is None
    assert violation(integrator().with_damping(3.0), b) is None
    for mass, damper in ((1.0, 2.0), (0.3, 7.0)):
        assert violation(mass_damper(mass, damper, mass / damper), b) is None
        assert violation(mass_damper(mass, damper, 0.9 * mass / damper), b) is not None


def test_a_mass_damper_by_its_position_is_refused_with_the_real_part_at_the_worst_frequency():
    """G = 1 / (s (s + 2)): Re G(j omega) = -1 / (omega^2 + 4)."""
    found = violation(mass_damper(1.0, 2.0, 0.0), 1.0)

    assert found == ("Re G(j omega) = -0.2 at omega = 1 rad/s, expected 0 or more; it reflects 1.41421 times the wave "
                     "that it gets, expected at most 1 (b = 1)")


def test_an_unstable_agent_is_refused_with_its_eigenvalue():
    found = violation(integrator().without_damping(1.0), 0.5)

    assert found == "Re lambda(A - b B C) = 0.5, expected below 0 (b = 0.5): a damper does not bring the agent to rest"


@pytest.mark.parametrize("seed", range(8))
def test_port_hamiltonian_agents_are_passive(seed):
    """A = (J - R) Q, C = B' Q with Q > 0, R >= 0, J skew: the KYP lemma holds with P = Q."""
    rng = np.random.default_rng(seed)
    n = 1 + seed % 4
    M, S, T = rng.normal(size=(3, n, n))
    Q, R, B = M @ M.T + 0.1 * np.eye(n), S @ S.T, rng.normal(size=(n, 1))

    assert violation(Agent((T - T.T - R) @ Q, B, B.T @ Q), rng.uniform(0.1, 10)) is None


def test_random_stable_agents_are_passive_where_a_scan_finds_no_negative_real_part():
    rng, omega, seen = np.random.default_rng(5), np.r_[0.0, np.logspace(-4, 4, 4001)], set()
    for _ in range(60):
        A = rng.normal(size=(3, 3))
        A -= (np.linalg.eigvals(A).real.max() + 0.3) * np.eye(3)
        B = rng.normal(size=(3, 1))
        agent = Agent(A, B, B.T + 0.5 * rng.normal(size=(1, 3)))
        lambdas, V = np.linalg.eig(A)
        residues = (agent.C @ V)[0] * np.linalg.solve(V, B)[:, 0]
        G = (residues / (1j * omega[:, None] - lambdas)).sum(axis=1)
        reflected = np.abs((G - 1) / (G + 1)).max()
        if abs(reflected - 1) < 1e-6 and G.real.min() < 0:
            continue                            # too near to the border for the scan
        seen.add(violation(agent, 1.0) is None)
        assert (violation(agent, 1.0) is None) == bool(G.real.min() >= 0)

    assert seen == {True, False}


def test_the_integral_of_the_output_is_taken_from_the_plant():
    agent, integral = read_agent([[-2, 0], [1, 0]], [[1], [0]], [[1, 0], [0, 1]])

    assert integral == 1
    assert (agent.A.tolist(), agent.B.tolist(), agent.C.tolist()) == ([[-2.0]], [[1.0]], [[1.0]])


@pytest.mark.parametrize(("A", "B", "C", "why"), [
    ([[0, 0], [2, 0]], [[1], [0]], [[1, 0], [0, 1]], "the integral of the output"),         # twice the output
    ([[0, 0], [1, -1]], [[1], [0]], [[1, 0], [0, 1]], "the integral of the output"),        # leaks
    ([[0, 1], [1, 0]], [[1], [0]], [[1, 0], [0, 1]], "the integral of the output"),         # affects the agent
    ([[0, 0], [1, 0]], [[1], [1]], [[1, 0], [0, 1]], "the integral of the output"),         # of the input too
    ([[0, 0], [1, 0]], [[1], [0]], [[1, 0], [0, 2]], "the integral of the output"),
    ([[0]], [[1, 1]], [[1]], "expected n x n, n x 1"),
    ([[0]], [[float("nan")]], [[1]], "finite numbers"),
])
def test_a_plant_that_does_not_fit_is_refused(A, B, C, why):
    with pytest.raises(ValueError, match=why):
        read_agent(A, B, C)
