"""Estimates x^ of a tracking error that is seen with noise at looks only (section 5.2.5), for many runs at once.

    measurement  y^ = x + nu, nu uniform in [-a, a]^3          between looks: flow under the held command, with e_omega

`ParticleObserver` is a bootstrap particle filter: nu is uniform, so a particle lives if it is within a of y^ in each
component. If all particles of a run die, they are drawn anew around y^, and `reinitialized` counts it.
`UnscentedObserver` takes nu and e_omega by their variances (Wan and van der Merwe 2000). Both take e_omega as constant
between two looks.

A member of this kind is asked at each look: `look(runs, y, u, held_s)` returns x^ of these runs.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from agents.optimal_triggering.decision_model import KNOT_S
from agents.optimal_triggering.held_loop import Floats, HeldLoop, flow
from agents.optimal_triggering.noise_points import held_share

Runs = NDArray[np.intp]
Mask = NDArray[np.bool_]


class Observer(Protocol):
    def look(self, runs: Runs, y: Floats, u: Floats, held_s: Floats) -> Floats:
        """Return x^ of shape (3, k) for measurements y of `runs`, which held the commands u (2, k) for held_s (k,).

        held_s = 0: there was no look before."""


@dataclass(eq=False)
class ParticleObserver:
    loop: HeldLoop
    count: int                                  # runs
    rng: np.random.Generator
    particles: int = 300
    measured: float = 0.15
    inputs: float = 0.3
    reinitialized: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        if self.particles < 2:
            raise ValueError(f"particles={self.particles}: expected 2 or more")
        self._x = np.zeros((3, self.count, self.particles))

    def look(self, runs: Runs, y: Floats, u: Floats, held_s: Floats) -> Floats:
        tau = held_s[:, None]
        e_omega = self.inputs * self.rng.uniform(-1, 1, (2, runs.size, self.particles)) * held_share(tau, KNOT_S)
        x = flow(self._x[:, runs], u[:, :, None], self.loop.inputs(e_omega), tau)
        alive: Mask = np.asarray((np.abs(x - y[:, :, None]) <= self.measured).all(axis=0))
        dead: Mask = np.asarray(~alive.any(axis=1))
        self.reinitialized += int((dead & (held_s > 0)).sum())
        around = y[:, dead, None] + self.measured * self.rng.uniform(-1, 1, (3, int(dead.sum()), self.particles))
        x[:, dead], alive[dead] = around, True
        estimate: Floats = (x * alive).sum(axis=2) / alive.sum(axis=1)
        living = alive.sum(axis=1)[:, None]
        places = (np.arange(self.particles) + self.rng.random((runs.size, 1))) / self.particles * living
        order = np.argsort(~alive, axis=1, kind="stable")                   # the living first
        chosen = np.take_along_axis(order, places.astype(np.intp), axis=1)
        self._x[:, runs] = np.take_along_axis(x, chosen[None], axis=2)
        return estimate


@dataclass(eq=False)
class UnscentedObserver:
    loop: HeldLoop
    count: int
    measured: float = 0.15
    inputs: float = 0.3
    reinitialized: int = 0                      # never

    def __post_init__(self) -> None:
        self._mean = np.zeros((3, self.count))
        self._covariance = np.zeros((self.count, 3, 3))

    def look(self, runs: Runs, y: Floats, u: Floats, held_s: Floats) -> Floats:
        k, n = runs.size, 5                                                 # 3 states, 2 inputs
        R = self.measured ** 2 / 3 * np.eye(3)
        root = np.zeros((k, n, n))
        root[:, :3, :3] = np.linalg.cholesky(self._covariance[runs] + 1e-12 * np.eye(3))
        sigma = self.inputs / np.sqrt(3) * held_share(held_s, KNOT_S)
        root[:, 3, 3] = root[:, 4, 4] = sigma
        spread = np.sqrt(n) * np.concatenate([root, -root], axis=2)         # (k, n, 2 n)
        x = self._mean[:, runs, None] + spread[:, :3].transpose(1, 0, 2)
        after = flow(x, u[:, :, None], self.loop.inputs(spread[:, 3:].transpose(1, 0, 2)), held_s[:, None])
        mean: Floats = np.asarray(after.mean(axis=2))
        away = after - mean[:, :, None]
        P = np.einsum("ikn,jkn->kij", away, away) / (2 * n)
        gain = P @ np.linalg.inv(P + R)
        first = held_s == 0
        gain[first] = np.eye(3)
        mean += np.einsum("kij,jk->ik", gain, y - mean)
        P = P - gain @ P
        P[first] = R
        self._mean[:, runs], self._covariance[runs] = mean, (P + P.transpose(0, 2, 1)) / 2
        return mean
