from math import exp, inf, log

import numpy as np
import pytest
import scipy.integrate
import scipy.optimize
from hypothesis import given
from hypothesis import strategies as st

from agents.triggering.error_gain import (
    KAPPA,
    SETTLED,
    error_gain,
    horizon_s,
    initial_error_gain,
    largest_horizon,
    longest_horizon_s,
)


@pytest.mark.parametrize("growth", [0.0, 1e-12, 0.3, 6.0, 80.0])
@pytest.mark.parametrize("tau_s", [1e-3, 0.0174, 0.045])
def test_both_gains_are_the_integrals_that_the_proof_bounds(growth, tau_s):
    area = scipy.integrate.quad(lambda s: exp(growth * s), 0, tau_s, epsabs=0, epsrel=1e-12)[0]

    assert error_gain(growth, tau_s) == pytest.approx(area, rel=1e-9)                          # Young's inequality
    for p in (1.0, 2.0, 7.0):
        norm = scipy.integrate.quad(lambda s, p=p: exp(growth * p * s), 0, tau_s, epsrel=1e-12)[0] ** (1 / p)
        assert initial_error_gain(growth, tau_s, p) == pytest.approx(norm, rel=1e-9)


def test_for_infinite_p_the_initial_error_is_not_forgotten():
    """The limit printed below (A.11), exp(a tau) - 1, would bound |e(0)| by 0 over a horizon of length 0."""
    assert initial_error_gain(6.0, 0.0, inf) == 1.0
    assert initial_error_gain(6.0, 0.02, inf) == exp(6.0 * 0.02)
    assert initial_error_gain(6.0, 0.02, 2e4) == pytest.approx(exp(6.0 * 0.02), rel=1e-3)     # (p a)^(-1/p) tends to 1


def test_after_a_long_silence_the_gains_are_infinite_and_not_an_error():
    assert error_gain(6.0, 3600.0) == inf
    assert initial_error_gain(6.0, 3600.0) == inf


def error_norms(A, e0, driven, tau_s, p, n=400):
    """||e||_p and ||y~||_p of e' = A e + y~, y~ = driven(t), by RK4; the norms by the trapezoidal rule."""
    t = np.linspace(0, tau_s, n + 1)
    h, e = tau_s / n, [np.array(e0, float)]

    def rate(s, z):
        return A @ z + driven(s)

    for k in range(n):
        z, s = e[-1], t[k]
        k1 = rate(s, z)
        k2 = rate(s + h / 2, z + h / 2 * k1)
        k3 = rate(s + h / 2, z + h / 2 * k2)
        k4 = rate(s + h, z + h * k3)
        e.append(z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
    sizes = [np.linalg.norm(z, axis=1) for z in (np.array(e), np.array([driven(s) for s in t]))]
    if p == inf:
        return [float(size.max()) for size in sizes]
    return [float(np.trapezoid(size**p, t) ** (1 / p)) for size in sizes]


@given(st.integers(0, 2**32 - 1), st.sampled_from([1.0, 2.0, inf]), st.floats(0.005, 0.3))
def test_errors_that_grow_as_fast_as_allowed_stay_within_the_bound(seed, p, tau_s):
    """(4.26) is an inequality: equality, as printed, would need one eigenvector for everything."""
    rng = np.random.default_rng(seed)
    A = np.abs(rng.normal(size=(3, 3))) * 3
    A = np.maximum(A, A.T)
    weights, frequency = np.abs(rng.normal(size=3)), rng.uniform(1, 60)
    e0 = np.abs(rng.normal(size=3)) * rng.choice([0.0, 0.1])
    a = float(np.linalg.norm(A, 2))

    error, drive = error_norms(A, e0, lambda s: weights * (1 + np.sin(frequency * s)), tau_s, p)

    bound = initial_error_gain(a, tau_s, p) * np.linalg.norm(e0) + error_gain(a, tau_s) * drive
    assert error <= bound * (1 + 1e-4)              # trapezoids of 400 steps, at most 18 rad in all: (18/400)^2 / 12


@given(st.floats(1e-6, 200), st.floats(1, 200), st.floats(0.1, 0.9999))
def test_the_horizon_is_where_the_product_of_gains_reaches_kappa(growth, gain, kappa):
    root = scipy.optimize.brentq(lambda tau: gain * error_gain(growth, tau) - kappa, 0, 1.01 * kappa / gain, xtol=1e-15)

    assert horizon_s(growth, gain, kappa) == pytest.approx(root, rel=1e-9)
    assert horizon_s(growth, gain, kappa) < longest_horizon_s(gain, kappa)


@given(st.floats(0, 100), st.floats(0.01, 100), st.floats(1, 100), st.floats(0.01, 100))
def test_horizons_shrink_with_growth_and_gain(growth, more, gain, greater):
    assert horizon_s(growth + more, gain) < horizon_s(growth, gain)
    assert horizon_s(growth, gain + greater) < horizon_s(growth, gain)
    assert horizon_s(0.0, gain) == KAPPA / gain


@given(st.floats(0, 50), st.floats(0, 5000), st.floats(5, 100))
def test_reach_and_horizon_are_found_together(at_rest, steepness, gain):
    def growth_until(tau_s):
        return at_rest + steepness * tau_s

    found = largest_horizon(growth_until, gain)

    high = KAPPA / gain + 1e-9
    root = scipy.optimize.brentq(lambda tau: horizon_s(growth_until(tau), gain) - tau, 0, high, xtol=1e-14)
    assert root - SETTLED * KAPPA / gain <= found.tau_s <= root * (1 + 1e-9)
    assert found.growth_per_s == growth_until(found.tau_s)


@given(st.lists(st.tuples(st.floats(0, 0.05), st.floats(0, 100)), min_size=1, max_size=6), st.floats(15, 100))
def test_where_the_growth_jumps_the_horizon_is_certified_and_no_longer_one_is(jumps, gain):
    def growth_until(tau_s):
        return sum(height for at, height in jumps if tau_s >= at)

    found = largest_horizon(growth_until, gain)

    assert gain * error_gain(growth_until(found.tau_s), found.tau_s) <= KAPPA * (1 + 1e-12)
    longer = found.tau_s + 1.01 * SETTLED * KAPPA / gain
    assert gain * error_gain(growth_until(longer), longer) > KAPPA


def test_a_steep_reachable_set_is_bisected():
    """Here the map from horizon to horizon does not contract: its slope at the crossing is below -1."""
    calls = []

    def growth_until(tau_s):
        calls.append(tau_s)
        return 1e4 * tau_s**3 * 1e5

    found = largest_horizon(growth_until, 20.0)

    before, after = (horizon_s(growth_until(found.tau_s * factor), 20.0) for factor in (0.999, 1.001))
    assert (after - before) / (found.tau_s * 0.002) < -1
    assert 20.0 * error_gain(growth_until(found.tau_s), found.tau_s) == pytest.approx(KAPPA, rel=1e-3)
    assert len(calls) < 2 * log(1 / SETTLED) / log(2) + 10


def test_a_growth_without_bound_leaves_no_horizon():
    assert largest_horizon(lambda tau_s: inf, 50.0).tau_s == 0.0
    assert largest_horizon(lambda tau_s: inf if tau_s > 0.01 else 1.0, 50.0).tau_s == pytest.approx(0.01, abs=3e-7)
    with pytest.raises(AssertionError, match="is no number"):
        largest_horizon(lambda tau_s: float("nan"), 50.0)


def test_p_below_one_is_no_norm():
    with pytest.raises(ValueError, match=r"p=0\.5: L_p norms need p >= 1"):
        initial_error_gain(1.0, 0.01, 0.5)
