"""The five agents and the two topologies of section 6.5.

Agents 2 to 4 cannot be read in the scan of the dissertation; this set reproduces every printed figure.
"""

from __future__ import annotations

import numpy as np
import pytest

from agents.synchronization.closed_loop import ClosedLoop, LinearAgent
from agents.synchronization.graph import Floats


@pytest.fixture(scope="session")
def five_agents() -> tuple[LinearAgent, ...]:
    return (
        LinearAgent([[-3, 1], [2, -1]], [[-4], [-4]], [[-4, 1]], [[2]]),
        LinearAgent([[1]], [[-1]], [[-4]], [[5]]),
        LinearAgent([[-2, -5], [1, -1]], [[-2], [-1]], [[1, 1]], [[2]]),
        LinearAgent([[-3, -1], [5, -3]], [[-4], [-2]], [[0, -4]], [[4]]),
        LinearAgent([[1, 3, 1], [0, -1, 1], [1, 0, 0]], [[-1], [-1], [1]], [[-1, -1, -1]], [[5]]),
    )


@pytest.fixture(scope="session")
def l1() -> Floats:
    """Laplacian of topology 1, equation (6.15)."""
    return np.array([[2., -1, 0, -1, 0], [0, 1, -1, 0, 0], [0, 0, 1, 0, -1], [-1, -1, 0, 2, 0], [0, 0, -1, -1, 2]])


@pytest.fixture(scope="session")
def l2() -> Floats:
    """Laplacian of topology 2, equation (6.37)."""
    return np.array([[1., -1, 0, 0, 0], [0, 1, -1, 0, 0], [0, 0, 1, 0, -1], [-1, 0, 0, 1, 0], [0, 0, -1, -1, 2]])


@pytest.fixture(scope="session")
def loop1(five_agents: tuple[LinearAgent, ...], l1: Floats) -> ClosedLoop:
    return ClosedLoop(five_agents, l1)


@pytest.fixture(scope="session")
def loop2(five_agents: tuple[LinearAgent, ...], l2: Floats) -> ClosedLoop:
    return ClosedLoop(five_agents, l2)
