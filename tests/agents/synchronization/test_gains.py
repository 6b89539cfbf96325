import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

from agents.synchronization import gains
from agents.synchronization.closed_loop import ClosedLoop, LinearAgent
from agents.synchronization.gains import RELATIVE_ACCURACY, a_star, h_infinity_norm, l2_gain, sigma_max
from agents.synchronization.graph import laplacian


def small_gain_system(loop):
    """The matrices as section 6.5 prints them."""
    return (loop.A_cl, np.hstack([loop.B_cl, loop.B_d]), loop.C_cl @ loop.A_cl,
            loop.C_cl @ np.hstack([np.zeros_like(loop.B_cl), loop.B_d]))


def swept(system):
    """A dense frequency sweep, then a one-dimensional maximization around its best point: a lower bound by nature."""
    A, B, C, D = system

    def largest(frequencies):
        resolvent = 1j * np.asarray(frequencies)[:, None, None] * np.eye(len(A)) - A
        inputs = np.broadcast_to(B, (len(resolvent), *B.shape))
        return np.linalg.norm(C @ np.linalg.solve(resolvent, inputs) + D, 2, (1, 2))

    grid = np.concatenate([[0.0], np.geomspace(1e-3, 1e5, 3000)])
    values = largest(grid)
    k = int(np.argmax(values))
    around = (grid[max(0, k - 1)], grid[min(len(grid) - 1, k + 1)])
    best = scipy.optimize.minimize_scalar(lambda w: -largest([w])[0], bounds=around, method="bounded",
                                          options={"xatol": 1e-10})
    return max(-best.fun, values[k], np.linalg.norm(D, 2))


def bounded_real(system, gamma):
    """Whether ||G|| < gamma, by the bounded real lemma: the Riccati equation has a stabilizing solution."""
    A, B, C, D = system
    R = D.T @ D - gamma**2 * np.eye(B.shape[1])
    try:
        X = scipy.linalg.solve_continuous_are(A, B, C.T @ C, R, s=C.T @ D)
    except np.linalg.LinAlgError:
        return False
    coupling = X @ B + C.T @ D
    residual = A.T @ X + X @ A + C.T @ C - coupling @ np.linalg.solve(R, coupling.T)
    closed = A - B @ np.linalg.solve(R, coupling.T)
    solved = np.linalg.norm(residual) <= 1e-6 * np.linalg.norm(C.T @ C)
    return bool(solved and np.linalg.eigvals(closed).real.max() < 0)


@pytest.mark.parametrize(("name", "printed", "ours"), [("loop1", 132, 132.084), ("loop2", 267, 266.618)])
def test_the_printed_gains(name, printed, ours, request):
    norm = l2_gain(request.getfixturevalue(name))

    assert norm.lower == pytest.approx(ours, abs=5e-4)
    assert round(norm.lower) == printed


@pytest.mark.parametrize("name", ["loop1", "loop2"])
def test_the_norm_is_the_maximum_of_a_frequency_sweep(name, request):
    loop = request.getfixturevalue(name)

    norm = l2_gain(loop)

    assert swept(small_gain_system(loop)) == pytest.approx(norm.lower, rel=2 * RELATIVE_ACCURACY)
    assert sigma_max(*small_gain_system(loop), norm.peak_rad_s) == pytest.approx(norm.lower, rel=1e-14)


@pytest.mark.parametrize("name", ["loop1", "loop2"])
def test_the_bracket_is_confirmed_by_the_bounded_real_lemma(name, request):
    system = small_gain_system(request.getfixturevalue(name))

    norm = h_infinity_norm(*system)

    assert bounded_real(system, norm.upper * (1 + 1e-5))        # as near as the Riccati solver gets
    assert not bounded_real(system, norm.lower * (1 - 1e-2))


def test_random_systems_never_exceed_the_bracket_and_reach_it():
    rng = np.random.default_rng(4)
    for _ in range(25):
        n = int(rng.integers(1, 7))
        A = rng.normal(size=(n, n))
        A -= (np.linalg.eigvals(A).real.max() + rng.uniform(0.01, 1)) * np.eye(n)
        system = (A, rng.normal(size=(n, 2)), rng.normal(size=(3, n)), rng.normal(size=(3, 2)) * rng.integers(0, 2))

        norm, sweep = h_infinity_norm(*system), swept(system)

        assert sweep <= norm.upper
        assert sweep == pytest.approx(norm.lower, rel=1e-6)         # the sweep's own accuracy


@pytest.mark.parametrize("damping", [1e-3, 1e-5])
def test_a_narrow_resonance_is_found_where_the_closed_form_has_it(damping):
    """1 / (s^2 + 2 zeta s + 1) peaks with 1 / (2 zeta sqrt(1 - zeta^2)) at sqrt(1 - 2 zeta^2)."""
    A = np.array([[0.0, 1.0], [-1.0, -2 * damping]])

    norm = h_infinity_norm(A, np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]]), np.zeros((1, 1)))

    exact = 1 / (2 * damping * np.sqrt(1 - damping**2))
    assert norm.lower == pytest.approx(exact, rel=RELATIVE_ACCURACY)


def test_a_gain_at_zero_and_one_at_infinite_frequency():
    A, B, C = np.array([[-2.0]]), np.array([[1.0]]), np.array([[3.0]])

    assert h_infinity_norm(A, B, C, np.zeros((1, 1))).lower == pytest.approx(1.5, rel=1e-12)
    assert h_infinity_norm(A, B, -C, np.array([[4.0]])).lower == pytest.approx(4.0, rel=1e-7)
    assert h_infinity_norm(A, 0 * B, C, np.zeros((1, 1))).upper == 0.0


def test_an_unstable_matrix_has_no_gain():
    with pytest.raises(ValueError, match=r"A has the eigenvalue 0\.5.*Assumption 6"):
        h_infinity_norm(np.array([[0.5]]), np.eye(1), np.eye(1), np.zeros((1, 1)))


def test_the_printed_a_star_of_the_first_topology(loop1):
    printed = [[48, 24, 0, 32, 0], [24, 20, 20, 32, 0], [0, 20, 6, 0, 6], [32, 32, 0, 64, 5], [0, 0, 6, 5, 10]]

    assert np.array_equal(a_star(loop1), printed)


def test_a_star_bounds_the_growth_of_the_error_entrywise():
    rng = np.random.default_rng(5)
    agents = [LinearAgent(rng.normal(size=(2, 2)), rng.normal(size=(2, 1)), rng.normal(size=(1, 2)), [[1.5]])
              for _ in range(4)]
    loop = ClosedLoop(agents, laplacian(4, [(0, 1), (1, 2), (2, 3), (3, 0), (0, 2)]))

    for e in rng.normal(size=(50, 4)):
        growth = np.abs(loop.C_cl @ loop.B_cl @ e)
        assert (growth <= gains.error_growth(loop) @ np.abs(e) * (1 + 1e-12)).all()
        assert (growth <= a_star(loop) @ np.abs(e) * (1 + 1e-12)).all()
    assert np.array_equal(a_star(loop), a_star(loop).T)
