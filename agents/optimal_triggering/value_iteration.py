"""Value iteration V <- min over tau of Q on a tabulated problem, until two steps differ by no more than a tolerance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.optimal_triggering.decision_model import DecisionModel
from agents.optimal_triggering.held_loop import Floats


@dataclass(frozen=True, eq=False)
class Solution:
    at_points: Floats           # V at the averager's points
    tau_s: Floats               # the best interval there
    iterations: int
    residual: float             # ||M V - V|| over the points
    contractions: Floats        # ratios of successive differences, as (5.11) bounds them


def iterate_values(model: DecisionModel, look_cost: float, start: Floats | float = 0.0, *, tolerance: float = 1e-3,
                   most: int = 2000) -> Solution:
    """Iterate from `start` until the sup norm of a step is at most `tolerance`; RuntimeError after `most` steps."""
    now = np.full(model.tau_s.shape[0], start) if np.isscalar(start) else np.array(start)
    now = now - model.reference
    steps: list[float] = []
    while True:
        after = model.lookahead(now, look_cost).min(axis=1)
        steps.append(float(np.abs(after - now).max()))
        now = after
        if steps[-1] <= tolerance:
            break
        if len(steps) >= most:
            raise RuntimeError(f"value iteration: a step of {steps[-1]:.3g} after {most} iterations, expected at most "
                               f"{tolerance:g}; allow more, or iterate policies")
    ahead = model.lookahead(now, look_cost)
    return Solution(now + model.reference, np.take_along_axis(model.tau_s, ahead.argmin(axis=1)[:, None], 1)[:, 0],
                    len(steps), float(np.abs(ahead.min(axis=1) - now).max()),
                    np.array(steps[1:]) / np.maximum(np.array(steps[:-1]), 1e-300))
