"""Computes a lower bound of the regional gains of the tracking loop that a quadratic function V = x'Px can prove.

    2 f(x, w)'P x + |y(x, w)|^2 <= gamma^2 |w|^2    for all |x| <= r and all w,     P >= 0

is linear in P and gamma^2, so each pair (x, w) is one linear inequality. The least gamma for some pairs is at most the
least one for all pairs: what is printed is a lower bound of what any quadratic function proves. Pairs are added where
the last P violates the inequality most, until it violates none by more than `SMALL` of |x|^2 + |w|^2.

    python -m benchmarks.quadratic_storage

Not modelled: a proof for all pairs, which the last P would need.
"""

from __future__ import annotations

from itertools import combinations_with_replacement
from math import inf, sqrt
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from scipy.optimize import linprog

from agents.tracking.controller import Inputs
from agents.tracking.nominal_system import NominalTracking
from agents.tracking.optimal_tables import REGIONAL
from agents.triggering.l2_gain import Floats

RADIUS = 1.0                # r of the regional gains
PAIRS, KEPT, ROUNDS, CLIMBS = 10_000, 400, 40, 30
SMALL = 1e-3
ENTRIES = list(combinations_with_replacement(range(3), 2))      # of P, upper triangle


class Terms(NamedTuple):
    of_p: Floats            # shape (6, n): the derivative of x'Px is of_p . (entries of P)
    output: Floats          # |y|^2
    size: Floats            # |x|^2 + |w|^2, by which an inequality is divided
    drive: Floats           # |w|^2

    def excess(self, p: Floats, gain_squared: float) -> Floats:
        return np.asarray((p @ self.of_p + self.output - gain_squared * self.drive) / self.size)


def terms(system: NominalTracking, x: Floats, w: Floats) -> Terms:
    f, y, drive = system.rate(x, w), system.output(x, w), (w * w).sum(axis=0)
    of_p = np.stack([2 * x[i] * f[i] if i == j else 2 * (x[i] * f[j] + x[j] * f[i]) for i, j in ENTRIES])
    return Terms(of_p, (y * y).sum(axis=0), (x * x).sum(axis=0) + drive, drive)


def least_gain(held: Inputs, radius: float, seed: int = 0) -> float:
    """Return the bound; inf if no quadratic function fulfils the inequalities found."""
    system, rng = NominalTracking(held), np.random.default_rng(seed)
    directions = rng.normal(size=(3, 3000))
    positive = -np.stack([directions[i] * directions[j] * (1 if i == j else 2) for i, j in ENTRIES])
    left, right = [np.vstack([positive, np.zeros(3000)]).T], [np.zeros(3000)]
    p, gain_squared = np.zeros(6), 0.0
    for _ in range(ROUNDS):
        found = terms(system, *_worst(system, radius, p, gain_squared, rng))
        if float(found.excess(p, gain_squared).max()) < SMALL:
            break
        left.append(np.vstack([found.of_p, -found.drive]).T / found.size[:, None])
        right.append(-found.output / found.size)
        best = linprog([0.0] * 6 + [1.0], A_ub=np.vstack(left), b_ub=np.concatenate(right),
                       bounds=[(None, None)] * 6 + [(0.0, None)])
        if best.x is None:
            return inf
        p, gain_squared = best.x[:6], float(best.x[6])
    return sqrt(gain_squared)


def _worst(system: NominalTracking, radius: float, p: Floats, gain_squared: float,
           rng: Generator) -> tuple[Floats, Floats]:
    """Return pairs that violate the inequality most, climbed to from random ones."""
    x = _unit(rng.normal(size=(3, PAIRS))) * radius * rng.uniform(size=PAIRS) ** (1 / 3)
    x[:, :PAIRS // 4] *= 10 ** rng.uniform(-3, 0, PAIRS // 4)
    w = _unit(rng.normal(size=(5, PAIRS))) * np.linalg.norm(x, axis=0) * 10 ** rng.uniform(-2, 1, PAIRS)
    w[:, ::7] = 0.0
    for climb in range(CLIMBS):
        best = np.argsort(-terms(system, x, w).excess(p, gain_squared))[:PAIRS // 20]
        x, w = np.repeat(x[:, best], 20, axis=1), np.repeat(w[:, best], 20, axis=1)
        step = 0.5 * 0.85 ** climb * (np.arange(x.shape[1]) % 20 > 0)      # one of each twenty stays
        across = np.linalg.norm(x, axis=0)
        x, w = (x + step * across * rng.normal(size=x.shape),
                w + step * (np.linalg.norm(w, axis=0) + 0.1 * across) * rng.normal(size=w.shape))
        x *= np.minimum(1.0, radius / np.linalg.norm(x, axis=0))
    best = np.argsort(-terms(system, x, w).excess(p, gain_squared))[:KEPT]
    return x[:, best], w[:, best]


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.linalg.norm(v, axis=0))


def main() -> None:
    for v_mps, omega_rad_s, searched in REGIONAL.rows:
        bound = least_gain(Inputs(v_mps, omega_rad_s), RADIUS)
        print(f"inputs ({v_mps:g}, {omega_rad_s:g}), |x| <= {RADIUS:g}: found by search {searched:g}; a quadratic "
              f"function proves no gain below {bound:.2f}", flush=True)


if __name__ == "__main__":
    main()
