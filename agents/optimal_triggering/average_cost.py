"""The semi-Markov average-cost problem (AVERAGE_COST) by modified relative value iteration (Puterman 1994, 11.4).

    Q = c + S - g tau + P h,     h <- min Q - h(x_0),     g such that min Q = 0 at the point x_0 in the middle
    then, `SWEEPS` times, the same with the intervals just chosen and not minimized: a sweep costs a fraction

It needs no linear equations; `policy_iteration` solves the same problem by these, and is compared with it in the tests.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from agents.optimal_triggering.decision_model import DecisionModel
from agents.optimal_triggering.policy_iteration import PolicySolution

SWEEPS = 10
MOST = 400


def solve_average_cost(model: DecisionModel, look_cost: float, *, tolerance: float = 1e-7,
                       progress: Callable[[], None] = lambda: None) -> PolicySolution:
    """Iterate until the Bellman equation holds to `tolerance` at every point; RuntimeError after MOST minimizations."""
    count, candidates = model.tau_s.shape
    rows, middle = np.arange(count), count // 2
    values = np.zeros(count)
    for iteration in range(1, MOST + 1):
        ahead = model.lookahead(values, look_cost)
        rate = float((ahead[middle] / model.tau_s[middle]).min())
        ahead -= rate * model.tau_s
        chosen = ahead.argmin(axis=1)
        best = ahead[rows, chosen]
        residual = float(np.abs(best - values).max())
        progress()
        if residual <= tolerance:
            return PolicySolution(values + model.reference, model.tau_s[rows, chosen], rate, iteration, residual)
        transitions = model.transitions[rows * candidates + chosen]
        tau_s, costs = model.tau_s[rows, chosen], model.costs[rows, chosen] + look_cost
        values = best
        for _ in range(SWEEPS):
            after = costs + transitions @ values
            values = after - tau_s * (after[middle] / tau_s[middle])
    raise RuntimeError(f"average cost: the Bellman equation is off by {residual:.3g} after {MOST} iterations, expected "
                       f"at most {tolerance:g}; choose a finer grid, or a longer shortest interval")
