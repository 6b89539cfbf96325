import numpy as np
import pytest

from agents.optimal_triggering.kernel_network import KernelNetwork
from agents.optimal_triggering.online import C_X
from agents.optimal_triggering.perceptron import Perceptron


def states(count, seed=3):
    return C_X[:, None] * np.random.default_rng(seed).uniform(-1, 1, (3, count))


@pytest.mark.parametrize("V", [Perceptron(np.random.default_rng(0), 100.0), KernelNetwork(100.0)],
                         ids=["perceptron", "kernels"])
def test_a_fit_is_exact_at_its_point(V):                                            # property (i)
    for x, value in zip(states(20).T, np.linspace(80, 120, 20), strict=True):
        V.fit(x, value)

        assert V(x[:, None])[0] == pytest.approx(value, rel=1e-8)


def test_a_kernel_network_changes_nothing_beyond_its_radius():                      # property (ii)
    V, x, others = KernelNetwork(100.0, radius=0.5), C_X * 0.2, states(500)
    away = np.linalg.norm(others / C_X[:, None] - 0.2, axis=0)
    before = V(others)

    V.fit(x, 120.0)

    changed = V(others) != before
    assert changed.any()
    assert not changed[away >= 0.5].any()


def test_a_perceptron_changes_v_nearly_everywhere():                                # so (ii) cannot hold for it
    V, others = Perceptron(np.random.default_rng(0), 100.0), states(500)
    before = V(others)

    V.fit(C_X * 0.2, 120.0)

    assert (V(others) != before).mean() > 0.99


def test_a_radius_of_nothing_is_refused():
    with pytest.raises(ValueError, match="radius=0"):
        KernelNetwork(radius=0)
