from math import exp, inf, log, pi

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
from hypothesis import given
from hypothesis import strategies as st

from agents.synchronization.closed_loop import ClosedLoop, LinearAgent
from agents.synchronization.exact_loop import ExactLoop
from agents.synchronization.gains import a_star, l2_gain
from agents.synchronization.graph import laplacian
from agents.synchronization.partition import partition
from agents.synchronization.round_plan import RoundPlan, plan_round
from agents.synchronization.slot_length import (
    Bound,
    SlotLength,
    error_gain,
    error_gain_by_logarithmic_norm,
    largest_tau_s,
    small_gain_tau_s,
    tau_star_s,
)


@pytest.mark.parametrize(("name", "tau_s", "printed_tau_s", "per_second", "printed_per_second"), [
    ("loop1", 1.08591e-3, 1.1e-3, 306.96, 307), ("loop2", 8.71074e-4, 8.7e-4, 382.67, 383)])
def test_the_printed_slot_lengths_and_broadcasts(name, tau_s, printed_tau_s, per_second, printed_per_second, request):
    length = SlotLength(small_gain_tau_s(request.getfixturevalue(name), 3), 3)

    assert length.tau_s == pytest.approx(tau_s, rel=5e-6)               # half of the last digit given
    assert float(f"{length.tau_s:.1e}") == printed_tau_s
    found = 1 / (3 * length.tau_s)              # broadcasts of an agent per second
    assert found == pytest.approx(per_second, abs=5e-3)
    assert round(found) == printed_per_second


def test_the_printed_tau1_is_not_certified(loop1):
    norm = float(np.linalg.norm(a_star(loop1), 2))

    assert l2_gain(loop1).lower * error_gain(norm, 3, 1.1e-3) > 1
    assert l2_gain(loop1).upper * error_gain(norm, 3, small_gain_tau_s(loop1, 3) * 0.999) < 1


def test_the_solution_is_that_of_an_independent_root_finder(loop1, loop2):
    for loop in (loop1, loop2):
        a, gamma = scipy.linalg.svdvals(a_star(loop))[0], l2_gain(loop).upper

        def product_minus_one(tau, a=a, gamma=gamma):       # (6.20) retyped
            return gamma * 3 * exp(a * 2 * tau) * (exp(a * tau) - 1) / (a * (2 - exp(a * 3 * tau))) - 1

        root = scipy.optimize.brentq(product_minus_one, 1e-9, log(2) / (3 * a) * (1 - 1e-9), xtol=1e-18, rtol=1e-14)
        assert small_gain_tau_s(loop, 3) == pytest.approx(root, rel=1e-12)


@given(st.floats(1e-3, 1e3), st.integers(1, 8), st.floats(1e-6, 0.99), st.floats(1e-6, 0.99))
def test_the_error_gain_grows_from_zero_to_infinity_at_tau_star(norm, parts, one, other):
    low, high = sorted(fraction * tau_star_s(norm, parts) for fraction in (one, other))

    assert error_gain(norm, parts, 0.0) == 0.0
    assert error_gain(norm, parts, low) <= error_gain(norm, parts, high)
    assert error_gain(norm, parts, high) >= parts * high * (1 - 1e-12)
    assert error_gain(norm, parts, tau_star_s(norm, parts)) == inf


def test_without_coupling_of_the_errors_the_gain_is_the_length_of_a_round():
    assert error_gain(0.0, 3, 0.25) == pytest.approx(0.75)
    assert error_gain_by_logarithmic_norm(np.zeros((2, 2)), 3, 0.25) == pytest.approx(0.75)


def error_system_gain(growth, parts, tau_s, slots=8, grid=16):
    """L2-gain from y~ to e of e' = M e + y~ with one component after the other reset, every tau: a discretized lifted
    operator over a finite horizon, so (up to the grid) a lower bound of every valid gamma_e."""
    n, h = len(growth), tau_s / grid
    step = scipy.linalg.expm(np.block([[growth, np.eye(n)], [np.zeros((n, 2 * n))]]) * h)
    Phi, Gamma = step[:n, :n], step[:n, n:]
    steps = slots * grid
    e, rows = np.zeros((n, steps * n)), []
    for k in range(steps):
        if k % grid == 0:
            e[(k // grid) % parts::parts] = 0
        e = Phi @ e
        e[:, k * n:(k + 1) * n] += Gamma
        rows.append(e.copy())
    return float(np.linalg.norm(np.vstack(rows), 2))


@pytest.mark.parametrize("fraction", [0.2, 0.6, 0.9])
@pytest.mark.parametrize("growth", [[[0, 1], [0, 0]], [[0, 8], [0, 0]], [[1, 2], [0, 3]], [[2, 1], [1, 2]]])
def test_no_bound_is_below_the_gain_of_the_error_system_itself(growth, fraction):
    M = np.array(growth, float)
    norm = float(np.linalg.norm(np.maximum(M, M.T), 2))
    tau_s = fraction * tau_star_s(norm, 2)

    true_gain = error_system_gain(M, 2, tau_s)

    assert true_gain <= error_gain(norm, 2, tau_s)
    assert true_gain <= error_gain_by_logarithmic_norm(M, 2, tau_s)
    assert true_gain <= 2 * tau_s / (1 - np.linalg.norm(M, 2) * 2 * tau_s) * (1 + 1e-9)


def test_the_logarithmic_norm_bounds_the_exponential_but_not_its_distance_from_one():
    """Why repair 10 cannot just replace ||A*|| by mu in (6.20)."""
    M, t = np.array([[0.0, 1.0], [0.0, 0.0]]), 0.3
    mu = np.linalg.eigvalsh((M + M.T) / 2)[-1]
    grown = scipy.linalg.expm(M * t)

    assert np.linalg.norm(grown, 2) <= exp(mu * t) * (1 + 1e-12)
    assert np.linalg.norm(grown - np.eye(2), 2) > exp(mu * t) - 1
    assert np.linalg.norm(grown - np.eye(2), 2) <= np.linalg.norm(M, 2) / mu * (exp(mu * t) - 1)


def test_the_other_bounds_allow_longer_slots(loop1, loop2):
    for loop, logarithmic, wirtinger in ((loop1, 1.17333e-3, 4.57632e-3), (loop2, 9.47090e-4, 2.24235e-3)):
        assert small_gain_tau_s(loop, 3, Bound.LOGARITHMIC_NORM) == pytest.approx(logarithmic, rel=5e-6)
        assert small_gain_tau_s(loop, 3, Bound.WIRTINGER) == pytest.approx(wirtinger, rel=5e-6)


def test_wirtingers_constant_is_attained_by_a_quarter_of_a_sine():
    """int e^2 / int e'^2 = (2 h / pi)^2 for e = sin(pi t / 2 h) on [0, h]: the factor pi / 2 of the bound is exact."""
    t = np.linspace(0, 1, 20001)
    e, rate = np.sin(pi * t / 2), pi / 2 * np.cos(pi * t / 2)

    assert np.trapezoid(e**2, t) / np.trapezoid(rate**2, t) == pytest.approx((2 / pi) ** 2, rel=1e-7)


@given(st.integers(0, 2**32 - 1))
def test_whatever_a_bound_certifies_is_stable_exactly(seed):
    """Random teams of three in a ring, 50 seeds by hypothesis: the monodromy matrix contracts at each bound's tau."""
    rng = np.random.default_rng(seed)
    agents = [LinearAgent(rng.normal(size=(2, 2)) - 2.5 * np.eye(2), rng.normal(size=(2, 1)), rng.normal(size=(1, 2)),
                          [[rng.uniform(0.1, 1)]]) for _ in range(3)]
    loop = ClosedLoop(agents, laplacian(3, [(0, 1), (1, 2), (2, 0)]))
    if loop.rightmost_eigenvalue.real >= 0:
        return
    parts = partition(loop.laplacian)
    exact = ExactLoop(tuple(agents), loop.laplacian, parts)

    for bound in Bound:
        assert exact.spectral_radius(small_gain_tau_s(loop, len(parts), bound) * 0.999) < 1


def test_slots_are_whole_nanoseconds_rounded_down_and_shared_among_losses():
    assert SlotLength(1.0000005e-3, 3, kappa=0.999).slot_ns == 999_000
    assert SlotLength(1e-3, 3, kappa=0.5, max_successive_losses=2).slot_ns == 166_666
    assert SlotLength(1e-3, 3, kappa=0.5, max_successive_losses=1).slot_ns == 250_000


def test_with_losses_successes_are_still_within_the_certified_interval(loop1):
    """N^D losses in a row put successes (N^D + 1) rounds apart: not the printed N^D (Remark 16)."""
    tau_s = small_gain_tau_s(loop1, 3)
    for losses in range(5):
        length = SlotLength(tau_s, 3, max_successive_losses=losses)

        assert (losses + 1) * length.slot_ns * 1e-9 < tau_s
        assert (losses + 2) * length.slot_ns * 1e-9 > tau_s


def test_the_plan_of_each_topology(five_agents, l1, l2):
    first, second = plan_round(five_agents, l1), plan_round(five_agents, l2)

    assert (first.slot_ns, second.slot_ns) == (1_084_826, 870_203)
    assert first.round_ns == 3 * 1_084_826
    assert [*map(tuple, first.parts)] == [(0, 2), (1, 4), (3,)]
    assert [*map(tuple, second.parts)] == [(0, 2), (1, 3), (4,)]


@pytest.mark.parametrize(("settings", "said"), [
    ({"kappa": 1.0}, r"kappa=1\.0: expected 0 < kappa < 1"), ({"kappa": 0.0}, r"kappa=0\.0"),
    ({"max_successive_losses": -1}, "max_successive_losses=-1: expected 0 or more"),
    ({"tau_s": 1e-10}, "shorter than 1 ns"), ({"parts": 0}, "parts=0")])
def test_slot_lengths_that_cannot_be_are_refused(settings, said):
    with pytest.raises(ValueError, match=said):
        SlotLength(**{"tau_s": 1e-3, "parts": 3, **settings})


def test_a_zero_gain_and_a_wrong_plan_are_refused(l1):
    with pytest.raises(ValueError, match=r"gamma=0\.0: expected a positive gain"):
        largest_tau_s(0.0, lambda tau_s: tau_s, 1)
    with pytest.raises(ValueError, match="belongs to one part, once"):
        RoundPlan(l1, ((0, 1), (1, 2), (3, 4)), 1000)
    with pytest.raises(ValueError, match="slot_ns=0"):
        RoundPlan(l1, ((0, 2), (1, 4), (3,)), 0)
