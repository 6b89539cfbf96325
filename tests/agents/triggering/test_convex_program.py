import numpy as np
import pytest
import scipy.optimize
from hypothesis import given, settings
from hypothesis import strategies as st

from agents.triggering.convex_program import least_norm


def by_a_general_solver(errors, required):
    """SLSQP on the entries of a symmetric 2 x 2 matrix, from several starts: an upper bound of the optimum."""
    def norm(z):
        return np.linalg.norm([[z[0], z[1]], [z[1], z[2]]], 2)

    slack = {"type": "ineq", "fun": lambda z: np.concatenate([errors @ z[:2] - required[:, 0],
                                                              errors @ z[1:] - required[:, 1]])}
    found = [scipy.optimize.minimize(norm, start, method="SLSQP", bounds=[(0, None)] * 3, constraints=[slack],
                                     options={"ftol": 1e-12, "maxiter": 300}) for start in ([5, 5, 5], [9, 0.1, 9])]
    return min(result.fun for result in found if result.success)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_the_optimum_is_that_of_a_general_solver(seed):
    rng = np.random.default_rng(seed)
    errors = np.abs(rng.normal(size=(15, 2)))
    required = errors @ np.abs(rng.normal(size=(2, 2))) * rng.uniform(0.2, 1, size=(15, 2))

    found = least_norm(errors, required, accuracy=1e-6)

    expected = by_a_general_solver(errors, required)
    assert found.lower <= expected * (1 + 1e-6)             # its constraints hold to 1e-6 or better
    assert found.upper == pytest.approx(expected, rel=1e-4)
    assert (errors @ found.matrix >= required - 1e-9).all()
    assert np.linalg.norm(found.matrix, 2) == pytest.approx(found.upper, rel=1e-12)


def test_samples_along_the_axes_give_the_entries_themselves():
    required = np.array([[1.0, 4.0], [2.0, 3.0]])           # of e = (1, 0) and of e = (0, 1): max(4, 2) across

    found = least_norm(np.eye(2), required)

    np.testing.assert_allclose(found.matrix, [[1, 4], [4, 3]], atol=1e-9)


@pytest.mark.parametrize(("errors", "required", "said"), [
    (np.zeros((1, 2)), np.ones((1, 2)), "no symmetric A >= 0 satisfies the samples"),
    (np.ones((1, 2)), np.ones((2, 2)), "expected two equal shapes"),
    (-np.ones((1, 2)), np.ones((1, 2)), "not finite, or a magnitude"),
    (np.ones((0, 2)), np.ones((0, 2)), "expected two equal shapes")])
def test_samples_that_no_matrix_satisfies_are_refused(errors, required, said):
    with pytest.raises(ValueError, match=said):
        least_norm(errors, required)
