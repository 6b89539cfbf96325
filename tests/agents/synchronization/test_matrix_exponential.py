import numpy as np
import pytest
import scipy.linalg

from agents.synchronization.matrix_exponential import matrix_exponential


@pytest.mark.parametrize("norm", [0.0, 1e-9, 1e-3, 1.0, 5.0, 30.0])
def test_agrees_with_scipy(norm):
    M = np.random.default_rng(6).normal(size=(12, 12))
    M *= norm / np.linalg.norm(M, 1)

    np.testing.assert_allclose(matrix_exponential(M), scipy.linalg.expm(M), rtol=1e-12, atol=1e-13 * np.exp(norm))


def test_a_rotation_and_a_nilpotent_matrix_in_closed_form():
    turned = matrix_exponential(np.array([[0.0, -40.0], [40.0, 0.0]]))
    sheared = matrix_exponential(np.array([[0.0, 3.0], [0.0, 0.0]]))

    np.testing.assert_allclose(turned, [[np.cos(40), -np.sin(40)], [np.sin(40), np.cos(40)]], atol=1e-13)
    np.testing.assert_allclose(sheared, [[1, 3], [0, 1]], atol=1e-15)
