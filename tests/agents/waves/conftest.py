from __future__ import annotations

import numpy as np
import pytest

from agents.waves.agent import Agent


def integrator() -> Agent:
    return Agent(np.zeros((1, 1)), np.ones((1, 1)), np.ones((1, 1)))


def mass_damper(mass: float, damper: float, lead_s: float) -> Agent:
    """q'' = (u - damper q') / mass, y = q + lead_s q'; passive if and only if lead_s damper >= mass."""
    A = np.array([[0.0, 1.0], [0.0, -damper / mass]])
    return Agent(A, np.array([[0.0], [1 / mass]]), np.array([[1.0, lead_s]]))


@pytest.fixture(scope="session")
def team_of() -> dict[int, tuple[Agent, ...]]:
    """Integrators and mass-dampers, two or five."""
    two = (integrator(), mass_damper(1.0, 2.0, 1.0))
    return {2: two, 5: (*two, integrator(), mass_damper(0.5, 1.0, 0.5), integrator())}
