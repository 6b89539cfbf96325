import numpy as np
import pytest
import scipy.linalg

from agents.triggering.l2_gain import GainEstimate, estimate_gain
from tests.oracles import cvxpy


class Linear:
    def __init__(self, A, B, C, D):
        self.A, self.B, self.C, self.D = (np.atleast_2d(np.asarray(M, float)) for M in (A, B, C, D))
        self.states, self.inputs = self.B.shape

    def rate(self, x, w):
        return self.A @ x + self.B @ w

    def output(self, x, w):
        return self.C @ x + self.D @ w

    def rate_adjoint(self, x, w, p):
        return self.A.T @ p, self.B.T @ p

    def output_adjoint(self, x, w, q):
        return self.C.T @ q, self.D.T @ q


class Cubic(Linear):
    """x' = -x + x^3 + w: infinite within a second for large inputs."""

    def rate(self, x, w):
        return -x + x**3 + w

    def rate_adjoint(self, x, w, p):
        return (-1 + 3 * x**2) * p, p


OSCILLATOR = Linear([[0, 1], [-4, -0.4]], [[0], [1]], [[1, 0], [0, 0.2]], [[0], [0.1]])

DAMPED = Linear([[0, 1], [-4, -2]], [[0], [1]], [[1, 0], [0, 0.2]], [[0], [0.1]])


def lifted_gain(system, horizon_s, steps, inner=4):
    """Largest singular value from held inputs to outputs: exact in the state, midpoint rule in the output."""
    h = horizon_s / steps / inner
    n, m = system.states, system.inputs

    def transition(t):
        held = np.block([[system.A, system.B], [np.zeros((m, n + m))]])
        return np.split(scipy.linalg.expm(held * t)[:n], [n], axis=1)

    (whole, whole_w), (half, half_w) = transition(h), transition(h / 2)
    x, rows = np.zeros((n, steps * m)), []
    for k in range(steps * inner):
        now = np.zeros((m, steps * m))
        now[:, k // inner * m:(k // inner + 1) * m] = np.eye(m)
        rows.append(system.C @ (half @ x + half_w @ now) + system.D @ now)
        x = whole @ x + whole_w @ now
    return float(np.linalg.norm(np.vstack(rows), 2)) * np.sqrt(h / (horizon_s / steps))


def test_the_gain_of_a_linear_system_is_the_largest_singular_value():
    found = estimate_gain(OSCILLATOR, 1.0, 6.0, steps=60, starts=4, iterations=40, tolerance=1e-5)

    expected = lifted_gain(OSCILLATOR, 6.0, 60)
    assert found.settled
    assert found.lower_estimate == pytest.approx(expected, rel=2e-3)    # RK4, 0.2 rad a step: 1e-5; the rest: settling
    assert found.lower_estimate <= expected * (1 + 5e-4)


def test_over_a_long_horizon_the_gain_is_that_of_the_bounded_real_lemma():
    """The smallest gamma with P >= 0 and [A'P + PA + C'C, PB + C'D; B'P + D'C, D'D - gamma^2 I] <= 0, by an SDP."""
    cp = cvxpy()
    A, B, C, D = DAMPED.A, DAMPED.B, DAMPED.C, DAMPED.D
    P, square = cp.Variable((2, 2), PSD=True), cp.Variable()
    bounded = cp.bmat([[A.T @ P + P @ A + C.T @ C, P @ B + C.T @ D],
                       [B.T @ P + D.T @ C, D.T @ D - square * np.eye(1)]])
    gamma = np.sqrt(cp.Problem(cp.Minimize(square), [bounded << 0]).solve("CLARABEL"))

    found = estimate_gain(DAMPED, 1.0, 30.0, steps=300, starts=4, iterations=100).lower_estimate

    assert 0.99 * gamma < found <= gamma * (1 + 1e-4)       # peak 1 rad/s wide: (pi / 30)^2 / 2 of the gain is missing


def test_of_a_linear_system_it_does_not_depend_on_the_amplitude():
    small, large = (estimate_gain(OSCILLATOR, amplitude, 5.0, steps=50, starts=2) for amplitude in (1e-3, 1e3))

    assert small.lower_estimate == pytest.approx(large.lower_estimate, rel=1e-9)


def test_a_longer_horizon_never_gains_less():
    gains = [estimate_gain(OSCILLATOR, 1.0, T, steps=40, starts=4, tolerance=1e-6).lower_estimate for T in (2, 5, 10)]

    assert gains == sorted(gains)                                           # Proposition 3


def test_an_estimate_says_what_it_is_an_estimate_of():
    found = estimate_gain(OSCILLATOR, 0.25, 5.0, steps=50, starts=2)

    assert isinstance(found, GainEstimate)
    assert (found.amplitude, found.horizon_s) == (0.25, 5.0)
    assert found.worst_input.shape == (50, 1)
    assert np.sqrt((found.worst_input**2).sum() * 5.0 / 50) == pytest.approx(0.25, rel=1e-12)


def test_more_starts_and_iterations_only_raise_a_lower_estimate():
    few = estimate_gain(OSCILLATOR, 1.0, 10.0, steps=50, starts=1, iterations=1)
    more = estimate_gain(OSCILLATOR, 1.0, 10.0, steps=50, starts=1, iterations=20)

    assert not few.settled
    assert few.lower_estimate < more.lower_estimate <= lifted_gain(OSCILLATOR, 10.0, 50) * (1 + 1e-3)


def test_starts_that_become_infinite_are_left_out_and_all_of_them_are_an_error():
    system = Cubic([[-1]], [[1]], [[1]], [[0]])

    assert 0 < estimate_gain(system, 1.0, 5.0, steps=50, starts=2, iterations=3).lower_estimate < 10
    with pytest.raises(RuntimeError, match=r"every input of amplitude 1e\+06 drives the state to infinity"):
        estimate_gain(system, 1e6, 5.0, steps=50, starts=2)


@pytest.mark.parametrize(("settings", "said"), [
    ({"amplitude": 0.0}, r"amplitude=0\.0: expected a positive number"), ({"horizon_s": float("inf")}, "horizon_s=inf"),
    ({"steps": 0}, "steps=0: expected 1 or more"), ({"starts": 0}, "starts=0"), ({"iterations": 0}, "iterations=0")])
def test_estimates_of_nothing_are_refused(settings, said):
    with pytest.raises(ValueError, match=said):
        estimate_gain(OSCILLATOR, **{"amplitude": 1.0, "horizon_s": 1.0, **settings})
