"""Policy iteration on a tabulated problem (Howard 1960): solve for the value of a policy, then improve it.

    discounted       (I - D P_tau) V = c + S
    average cost     h + g tau = c + S + P_tau h,     h(first point) = 0          (a semi-Markov problem)

PER_SECOND needs it: with tau of 20 ms the discount of an interval is .999 and value iteration takes 18 000 steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array, diags_array, eye_array, hstack
from scipy.sparse.linalg import splu

from agents.optimal_triggering.decision_model import DecisionModel
from agents.optimal_triggering.held_loop import Floats

MOST = 60
SAME = 1e-9                     # improvement of Q, relative, below which a candidate counts as no better

Choice = NDArray[np.intp]       # the chosen candidate of each point


@dataclass(frozen=True, eq=False)
class PolicySolution:
    at_points: Floats           # V, or h of the average cost
    tau_s: Floats
    rate: float                 # g: cost per second of the average-cost problem, 0 for a discounted one
    iterations: int
    residual: float             # of the Bellman equation over the points


def iterate_policies(model: DecisionModel, look_cost: float, *, average: bool,
                     progress: Callable[[], None] = lambda: None) -> PolicySolution:
    """Improve a policy until it no longer changes; RuntimeError if it still does after MOST steps."""
    count, candidates = model.tau_s.shape
    chosen = np.full(count, candidates - 1)
    rows = np.arange(count)
    for iteration in range(1, MOST + 1):
        values, rate = _evaluate(model, chosen, look_cost, average)
        ahead = model.lookahead(values, look_cost, rate)
        best, own = ahead.min(axis=1), ahead[rows, chosen]
        better = best < own - SAME * (1 + np.abs(own))
        progress()
        if not better.any():
            return PolicySolution(values + model.reference, model.tau_s[rows, chosen], rate, iteration,
                                  float(np.abs(best - values).max()))
        chosen = np.where(better, ahead.argmin(axis=1), chosen)
    raise RuntimeError(f"policy iteration still changes {int(better.sum())} of {count} states after {MOST} steps: "
                       "choose fewer candidate intervals")


def _evaluate(model: DecisionModel, chosen: Choice, look_cost: float,
              average: bool) -> tuple[Floats, float]:
    """Return the value of each point under the chosen candidates, and the cost rate g (0 if not `average`)."""
    count, candidates = model.tau_s.shape
    rows = np.arange(count)
    after = model.transitions[rows * candidates + chosen]
    costs = model.costs[rows, chosen] + look_cost
    left = csr_array(eye_array(count) - diags_array(model.discounts[rows, chosen]) @ after)
    if not average:
        return splu(csc_array(left)).solve(costs), 0.0
    middle = count // 2                                 # h is 0 there: the column takes g instead
    keep = np.flatnonzero(rows != middle)
    tau = csr_array(model.tau_s[rows, chosen][:, None])
    found = splu(csc_array(hstack([left[:, keep[:middle]], tau, left[:, keep[middle:]]]))).solve(costs)
    values, rate = found.copy(), float(found[middle])
    values[middle] = 0.0
    return values, rate
