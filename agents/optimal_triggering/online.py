"""Online value iteration (Desired Properties, section 5.2.4): a random x' each step, and V fitted to (M V)(x') there.

    V_i+1(x') = (M V_i)(x')                         property (i)
    stop when ||V_i+1 - V_i|| < epsilon for N steps in a row                                         Remark 12

The sup norm is taken over a sample of C_x. `run_online` returns the true Bellman residual ||M V - V|| over that sample
beside the step at which the rule stops.

Differs from the dissertation: its stop rule is not convergence. It ends after a run of states x' at which little had to
be changed, whatever V is elsewhere; and Remark 9's nonexpansion holds near x' only. Properties (i) to (iii) cannot all
hold for a perceptron: the difference of two analytic functions that is not 0 has no small support.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from agents.optimal_triggering.formulation import GAMMA, Formulation
from agents.optimal_triggering.held_loop import Floats, HeldLoop, flow
from agents.optimal_triggering.noise_points import NoisePoints
from agents.optimal_triggering.rollouts import Intervals

C_X = np.array([100.0, 100.0, 30 * np.pi])          # half widths of C_x, section 5.3


class Approximator(Protocol):
    def __call__(self, x: Floats) -> Floats:
        """Return V at states of shape (3, n)."""

    def fit(self, x: Floats, value: float) -> None:
        """Change V so that it has `value` at the state x of shape (3,)."""


@dataclass(frozen=True)
class PointBackup:
    """(M V)(x) at any states, with candidate intervals as shares of the largest one."""

    loop: HeldLoop
    largest: Intervals
    look_cost: float
    noise: NoisePoints
    shares: tuple[float, ...] = (0.0, 0.25, 0.5, 0.75, 1.0)
    formulation: Formulation = Formulation.PER_TRANSMISSION
    gamma: float = GAMMA

    def __call__(self, V: Approximator, x: Floats) -> Floats:
        count, n = x.shape[1], self.noise.weights.size
        at, u = x[:, :, None], self.loop.command(x)[:, :, None]
        inputs = self.loop.inputs(self.noise.e_omega[:, None, :])
        largest = self.largest(x)
        best = np.full(count, np.inf)
        for share in self.shares:
            tau = share * largest
            after = flow(at, u, inputs, tau[:, None])
            later = V(after.reshape(3, -1)).reshape(count, n) @ self.noise.weights
            cost = self.loop.cost(at, u, inputs, tau[:, None]) @ self.noise.weights
            best = np.minimum(best, cost + self.look_cost + self.formulation.discount(tau, self.gamma) * later)
        return best


class Stopped(NamedTuple):
    steps: int
    residual: float         # sup over the sample of |M V - V|
    low: float              # of V over the sample
    high: float


def run_online(V: Approximator, backup: PointBackup, rng: np.random.Generator, *, epsilon: float = 1.0,
               in_a_row: int = 10, most: int = 20_000, sample: int = 400) -> Stopped:
    """Fit V at random states of C_x until the stop rule ends it, at the latest after `most` steps."""
    states = C_X[:, None] * rng.uniform(-1, 1, (3, sample))
    before, quiet, steps = V(states), 0, 0
    while quiet < in_a_row and steps < most:
        x = C_X * rng.uniform(-1, 1, 3)
        V.fit(x, float(backup(V, x[:, None])[0]))
        now = V(states)
        quiet = quiet + 1 if float(np.abs(now - before).max()) < epsilon else 0
        before, steps = now, steps + 1
    return Stopped(steps, float(np.abs(backup(V, states) - before).max()), float(before.min()), float(before.max()))
