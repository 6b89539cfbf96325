"""The case study of section 5.3: what the three formulations give for inputs (1, 1), weights and noise as printed.

The states of F1 and F2 are the printed C_x on a coarse grid; averagers give F1 exactly on any grid. F3 is solved on the
table of the policy `optimal`, with the exact local limit as its cap.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import pi
from typing import Final, NamedTuple

import numpy as np

from agents.optimal_triggering.averager import Averager, Grid, NearestNeighbours, symmetric, values
from agents.optimal_triggering.decision_model import DecisionModel, tabulate
from agents.optimal_triggering.formulation import Formulation
from agents.optimal_triggering.held_loop import Floats, HeldLoop
from agents.optimal_triggering.noise_points import simpson
from agents.optimal_triggering.online import PointBackup, Stopped, run_online
from agents.optimal_triggering.perceptron import Perceptron
from agents.optimal_triggering.policy_iteration import PolicySolution, iterate_policies
from agents.optimal_triggering.rollouts import Intervals, Rollouts, discounted, roll_out
from agents.optimal_triggering.value_iteration import Solution, iterate_values
from agents.tracking.controller import Inputs
from agents.tracking.error_system import TrackingErrorSystem
from agents.tracking.optimal_settings import OptimalSettings
from agents.tracking.optimal_tables import best_intervals, tabulated
from agents.tracking.reference_inputs import Piece, ReferenceInputs
from agents.tracking.section_4_6 import GAINS
from agents.triggering.policies.input_output import IndividualGains

HELD: Final = Inputs(1.0, 1.0)
S: Final = 15.0
E_OMEGA: Final = 0.3
REFERENCE: Final = ReferenceInputs((Piece(0, Inputs(1.0, 1.0)), Piece(1_830_000_000, Inputs(0.6, 0.15)),
                                    Piece(8_800_000_000, Inputs(2.0, 2.0))))
FAR: Final = np.array([5.0, 5.0, 1.0])
RUNS: Final = 200
LENGTH_S: Final = 20.0
LOOP: Final = HeldLoop(HELD)


@cache
def _trigger() -> IndividualGains[tuple[float, float, float], Inputs]:
    return IndividualGains(TrackingErrorSystem(), GAINS)


def tau_max(x: Floats, held: Inputs = HELD) -> Floats:
    """Return the printed tau_max [s] of Chapter 4 at states of shape (3, n)."""
    return np.array([_trigger().decide(0, (x1, x2, x3), held).valid_ns * 1e-9 for x1, x2, x3 in x.T.tolist()])


def share_of_tau_max(share: float) -> Intervals:
    return lambda x: share * tau_max(x)


def constant(tau_s: float) -> Intervals:
    return lambda x: np.full(x.shape[1], tau_s)


# --- F1, as printed


def coarse_grid() -> Grid:
    across = symmetric(2, 5, 15, 30, 60, 100)
    return Grid(across, across, symmetric(0.7, 2, pi, 15, 30 * pi))


def neighbours() -> NearestNeighbours:
    """The grid's states, scaled by C_x, as points of a nearest-neighbour averager."""
    return NearestNeighbours(coarse_grid().points, 4, (100.0, 100.0, 30 * pi))


def printed_problem(averager: Averager) -> DecisionModel:
    tau_s = tau_max(averager.points)[:, None] * np.array([0.0, 0.1, 0.3, 0.6, 0.9, 1.0])
    return tabulate(LOOP, averager, tau_s, Formulation.PER_TRANSMISSION, simpson(E_OMEGA))


def printed_solution(model: DecisionModel, start: float, look_cost: float = S) -> Solution:
    return iterate_values(model, look_cost, start)


def printed_rollout(share: float, look_cost: float = S) -> float:
    """Return J of (5.5) from (5, 5, 1) without noise, to 1e-9."""
    return discounted(LOOP, share_of_tau_max(share), FAR, look_cost, 700)


@cache
def _coarse_tau_max() -> tuple[Grid, Floats]:
    grid = coarse_grid()
    return grid, tau_max(grid.points)


def printed_perceptron(seed: int, level: float) -> Stopped:
    """Run the printed online iteration with 100 hidden neurons until its stop rule ends it."""
    grid, at_points = _coarse_tau_max()
    backup = PointBackup(LOOP, lambda x: values(grid, at_points, x), S, simpson(E_OMEGA))
    return run_online(Perceptron(np.random.default_rng(seed), level), backup, np.random.default_rng((seed, 1)))


# --- F2, weights per second


@cache
def per_second_problem(*shares: float) -> DecisionModel:
    across = symmetric(0.25, 1, 4, 15, 100)
    grid = Grid(across, across, symmetric(0.25, 1, pi, 30 * pi))
    return tabulate(LOOP, grid, tau_max(grid.points)[:, None] * np.array(shares), Formulation.PER_SECOND,
                    simpson(E_OMEGA))


def per_second(look_cost: float, *shares: float) -> tuple[PolicySolution, DecisionModel]:
    """Return the solution for candidate intervals that are shares of tau_max."""
    model = per_second_problem(*shares)
    return iterate_policies(model, look_cost, average=False), model


def value_at_rest(solution: PolicySolution) -> float:
    return float(solution.at_points[solution.at_points.size // 2])


# --- F3, long-run mean


@cache
def _average_problem() -> tuple[DecisionModel, Grid]:
    model, grid, _ = tabulated(OptimalSettings(), GAINS, HELD)
    return model, grid


class Learned(NamedTuple):
    policy: Intervals
    tau_at_rest_s: float
    rate: float             # cost per second that the model expects


@cache
def learned(look_cost: float) -> Learned:
    model, grid = _average_problem()
    tau_s, rate, _ = best_intervals(OptimalSettings(), model, look_cost)
    return Learned(lambda x: values(grid, tau_s, x), float(tau_s[tau_s.size // 2]), rate)


def runs_of(policy: Intervals, start: Floats | None = None, length_s: float = LENGTH_S, runs: int = RUNS,
            seed: int = 1) -> Rollouts:
    """Run the policy with both noises; runs of equal seeds meet the same e_omega."""
    return roll_out(LOOP, policy, np.zeros(3) if start is None else start, length_s, runs, np.random.default_rng(seed))


@cache
def constant_runs(tau_s: float, far: bool = False, runs: int = RUNS) -> Rollouts:
    return runs_of(constant(tau_s), FAR if far else None, 12.0 if far else LENGTH_S, runs)


CONSTANTS: Final = (0.2, 0.4, 0.6, 0.8, 1.0)


def best_constant(look_cost: float, far: bool = False, intervals: tuple[float, ...] = CONSTANTS,
                  progress: Callable[[], None] = lambda: None) -> tuple[float, float]:
    """Return the least cost per second of constant intervals, and the interval [s]."""
    found = []
    for tau_s in intervals:
        found.append((constant_runs(tau_s, far).rate(look_cost).mean, tau_s))
        progress()
    return min(found)
