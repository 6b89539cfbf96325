"""Solvers against each other, against a closed form, and against rollouts."""

from math import exp, log

import numpy as np
import pytest

from agents.optimal_triggering.average_cost import solve_average_cost
from agents.optimal_triggering.averager import Grid, symmetric, values
from agents.optimal_triggering.decision_model import tabulate
from agents.optimal_triggering.formulation import GAMMA, Formulation
from agents.optimal_triggering.held_loop import HeldLoop
from agents.optimal_triggering.local_limit import local_limit_s, spectral_radius
from agents.optimal_triggering.lyapunov_shape import lyapunov_shape
from agents.optimal_triggering.noise_points import NO_NOISE, cubature, simpson
from agents.optimal_triggering.policy_iteration import iterate_policies
from agents.optimal_triggering.rollouts import confidence, roll_out
from agents.optimal_triggering.value_iteration import iterate_values
from agents.tracking.controller import Inputs

LOOP = HeldLoop(Inputs(1.0, 1.0))
GRID = Grid(symmetric(0.2, 0.6, 2.0, 6.0), symmetric(0.2, 0.6, 2.0, 6.0), symmetric(0.3, 1.0, 3.0))
TAU_S = np.tile([0.05, 0.1, 0.2, 0.4], (GRID.points.shape[1], 1))


def average_model(shaped):
    return tabulate(LOOP, GRID, TAU_S, Formulation.AVERAGE_COST, cubature(0.15, 0.3),
                    shape=lyapunov_shape(LOOP) if shaped else None)


@pytest.mark.parametrize("look_cost", [1e-3, 1e-2])
def test_relative_value_iteration_solves_what_linear_equations_solve(look_cost):
    model = average_model(shaped=True)

    ours, exact = solve_average_cost(model, look_cost), iterate_policies(model, look_cost, average=True)

    assert ours.rate == pytest.approx(exact.rate, abs=1e-6)
    assert ours.at_points - ours.at_points[ours.at_points.size // 2] == pytest.approx(exact.at_points, abs=1e-4)
    assert exact.residual < 1e-9


def test_a_look_that_costs_more_is_taken_later():
    model = average_model(shaped=True)
    middle = GRID.points.shape[1] // 2

    at_rest = [solve_average_cost(model, look_cost).tau_s[middle] for look_cost in (0.0, 1e-3, 1e-1)]

    assert at_rest == sorted(at_rest)
    assert at_rest[0] < at_rest[-1] == 0.4


def test_value_and_policy_iteration_agree_on_a_discounted_cost():
    model = tabulate(LOOP, GRID, TAU_S, Formulation.PER_SECOND, simpson(0.3), gamma=0.5)

    ours, exact = iterate_values(model, 0.1, tolerance=1e-6), iterate_policies(model, 0.1, average=False)

    # a step below 1e-6 leaves at most 1e-6 / (1 - 0.5^0.05) of the sum
    assert ours.at_points == pytest.approx(exact.at_points, abs=1e-6 / (1 - 0.5 ** 0.05))


def test_at_rest_without_noise_the_value_has_a_closed_form():
    model = tabulate(LOOP, GRID, TAU_S[:, :1], Formulation.PER_SECOND, NO_NOISE)

    ours = iterate_policies(model, 15.0, average=False)

    weight = exp(log(GAMMA) * 0.05)             # x stays 0 and u is (1, 1): u'Ru = 0.2 per second
    assert ours.at_points[ours.at_points.size // 2] == pytest.approx((15.0 + 0.2 * 0.05) / (1 - weight))


def test_an_iteration_that_does_not_settle_says_so():
    model = tabulate(LOOP, GRID, TAU_S, Formulation.PER_SECOND, NO_NOISE)

    with pytest.raises(RuntimeError, match="after 3 iterations"):
        iterate_values(model, 15.0, most=3)


def test_the_local_limit_is_where_looks_stop_to_stabilize():
    limit_s = local_limit_s(LOOP)

    assert limit_s == pytest.approx(1.176, abs=5e-4)
    assert spectral_radius(LOOP, 0.999 * limit_s) < 1 < spectral_radius(LOOP, 1.001 * limit_s)
    start = np.full(3, 1e-4)
    decayed, grown = (np.abs(roll_out(LOOP, lambda x, tau=tau: np.full(x.shape[1], tau), start, 100 * tau, 1,
                                      np.random.default_rng(0), measured=0.0, inputs=0.0).final).max()
                      for tau in (0.9 * limit_s, 1.1 * limit_s))
    assert decayed < 1e-4 < grown


def test_a_reference_that_stands_has_no_local_limit():
    with pytest.raises(ValueError, match="reference has to move"):
        local_limit_s(HeldLoop(Inputs(0.0, 0.0)))


def test_quadrature_points_have_the_moments_of_the_noise():
    points, printed = cubature(0.15, 0.3), simpson(0.3)

    assert points.nu ** 2 @ points.weights == pytest.approx([0.15 ** 2 / 3] * 3)
    assert points.e_omega ** 2 @ points.weights == pytest.approx([0.3 ** 2 / 3] * 2)
    assert printed.e_omega ** 2 @ printed.weights == pytest.approx([0.3 ** 2 / 3] * 2)
    assert printed.weights.sum() == points.weights.sum() == pytest.approx(1)
    assert points.nu @ points.weights == pytest.approx(0)


def test_rollouts_count_looks_and_charge_for_what_was_driven():
    found = roll_out(LOOP, lambda x: np.full(x.shape[1], 0.25), np.zeros(3), 2.0, 5, np.random.default_rng(0),
                     measured=0.0, inputs=0.0)

    assert found.looks == pytest.approx(8)
    assert found.running == pytest.approx(0.2 * 2.0)
    assert found.rate(0.5).mean == pytest.approx(0.2 + 8 * 0.5 / 2.0)


def test_the_learned_policy_costs_less_than_any_constant_interval_from_far_away():
    look_cost, start = 5e-3, np.array([3.0, 3.0, 1.0])
    tau_s = solve_average_cost(average_model(shaped=True), look_cost).tau_s
    policies = [lambda x: values(GRID, tau_s, x), *(lambda x, tau=tau: np.full(x.shape[1], tau) for tau in TAU_S[0])]

    learned, *constant = (roll_out(LOOP, policy, start, 8.0, 40, np.random.default_rng(1)).rate(look_cost)
                          for policy in policies)

    best = min(constant)
    assert learned.mean + learned.half_width < best.mean - best.half_width


def test_a_confidence_interval_covers_the_mean_as_often_as_it_says():
    rng = np.random.default_rng(0)

    covered = sum(abs((found := confidence(rng.normal(1.0, size=20))).mean - 1) <= found.half_width
                  for _ in range(300))
    sigma = (300 * 0.95 * 0.05) ** 0.5
    assert abs(covered - 285) < 4 * sigma
