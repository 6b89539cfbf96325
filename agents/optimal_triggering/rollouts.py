"""Simulates many runs of the loop under one policy, each with its own noise; returns the mean cost and its interval.

In each run R1 measures y^ = x + nu, computes u, holds it for tau = policy(y^), and again. e_omega is linear between
independent uniform values 0.1 s apart, held for `HOLD_S` at its value in the middle; it goes on through looks. The last
interval ends at the horizon.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import stats

from agents.optimal_triggering.decision_model import KNOT_S
from agents.optimal_triggering.formulation import GAMMA
from agents.optimal_triggering.held_loop import Floats, HeldLoop, flow
from agents.optimal_triggering.observers import Observer

HOLD_S = 0.05
Intervals = Callable[[Floats], Floats]          # measured states (3, n) -> tau [s] (n,)


class Mean(NamedTuple):
    mean: float
    half_width: float               # of the 95 % confidence interval
    runs: int
    variance: float                 # of the samples

    def __str__(self) -> str:
        return f"{self.mean:.5f} +- {self.half_width:.5f}"


@dataclass(frozen=True, eq=False)
class Rollouts:
    running: Floats                 # integral of x'Qx + u'Ru of each run
    looks: Floats                   # number of looks of each run
    length_s: float
    final: Floats                   # x at the end, shape (3, runs)

    def rate(self, look_cost: float) -> Mean:
        """Return the mean cost per second, S counted once for each look."""
        return confidence((self.running + look_cost * self.looks) / self.length_s)


def confidence(samples: Floats, level: float = 0.95) -> Mean:
    """Return the mean of independent samples and the half width of its interval by Student's t."""
    n = samples.size
    half = float(stats.t.ppf((1 + level) / 2, n - 1) * stats.sem(samples)) if n > 1 else 0.0
    return Mean(float(samples.mean()), half, n, float(samples.var(ddof=1)) if n > 1 else 0.0)


def roll_out(loop: HeldLoop, policy: Intervals, start: Floats, length_s: float, runs: int, rng: np.random.Generator, *,
             measured: float = 0.15, inputs: float = 0.3, observer: Observer | None = None) -> Rollouts:
    """Run the loop `runs` times from `start` over length_s; `measured` and `inputs` are the amplitudes of the noise.

    With an observer command and policy get its estimate x^, without one y^."""
    blocks = round(length_s / KNOT_S) + 2
    knots = inputs * rng.uniform(-1, 1, (2, blocks, runs))
    x = np.repeat(np.asarray(start, dtype=np.float64)[:, None], runs, axis=1)
    running, looks = np.zeros(runs), np.zeros(runs)
    t, due, asked = np.zeros(runs), np.zeros(runs), np.zeros(runs)
    u = np.zeros((2, runs))
    every = np.arange(runs)
    while (active := np.flatnonzero(t < length_s - 1e-9)).size:
        asking = active[t[active] >= due[active] - 1e-12]
        if asking.size:
            y = x[:, asking] + measured * rng.uniform(-1, 1, (3, asking.size))
            if observer is not None:
                y = observer.look(asking, y, u[:, asking], t[asking] - asked[asking])
            u[:, asking] = loop.command(y)
            asked[asking] = t[asking]
            due[asking] = t[asking] + policy(y)
            looks[asking] += 1
        now, until = t[active], np.minimum(due[active], length_s)
        if inputs:
            piece = np.floor(now / HOLD_S + 1e-9)
            until = np.minimum(until, (piece + 1) * HOLD_S)
            middle = (piece + 0.5) * HOLD_S / KNOT_S
            k = middle.astype(np.intp)
            share = middle - k
            error = knots[:, k, every[active]] * (1 - share) + knots[:, k + 1, every[active]] * share
        else:
            error = np.zeros((2, active.size))
        step = np.maximum(until - now, 0.0)
        omega_p = loop.inputs(error)
        running[active] += loop.cost(x[:, active], u[:, active], omega_p, step)
        x[:, active] = flow(x[:, active], u[:, active], omega_p, step)
        t[active] = until
    return Rollouts(running, looks, length_s, x)


def discounted(loop: HeldLoop, policy: Intervals, start: Floats, look_cost: float, looks: int,
               gamma: float = GAMMA) -> float:
    """Return J of (5.5) without noise over `looks` looks, the first one weighted by 1, as in (5.9)."""
    x = np.asarray(start, dtype=np.float64)[:, None]
    total = 0.0
    for k in range(looks):
        u, tau = loop.command(x), policy(x)
        total += gamma ** k * (float(loop.cost(x, u, loop.inputs(), tau)[0]) + look_cost)
        x = flow(x, u, loop.inputs(), tau)
    return total
