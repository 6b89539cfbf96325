"""Search for quadratic functions that decay under every one of several linear maps.

    maximize alpha   subject to   P_i > 0,   F_k = exp(-2 alpha h_k) P_i - M_k' P_j M_k > 0   for every step k: i -> j

With one function (`search`) all i, j are the same; with several (`search_several`) a step may end in another one. This
generalized eigenvalue problem is quasi-convex, and is solved by the method of centers (Boyd and El Ghaoui 1993):
alpha grows by the part STEP towards the largest value that P allows, then Newton's method minimizes
sum tr P_i - sum log det P_i - sum log det F_k. `dwell_time` and `slot_dwell` check the result by eigenvalues,
independently.

Not modelled: a proof that no P exists if none is found; functions other than quadratic ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.synchronization.graph import Floats

STEP = 0.8                  # share of the possible increase of alpha; any value in (0, 1) converges
RELATIVE_GAIN = 1e-4        # the search stops when a step improves alpha by a smaller share of it
MAX_STEPS = 200
MAX_NEWTON_STEPS = 50


class Step(NamedTuple):
    """A map z -> M z of `duration_s`, before which the function number `before` counts, and then `after`."""

    before: int
    after: int
    M: Floats
    duration_s: float


def rates_per_s(P: Floats, maps: Sequence[Floats], periods_s: Sequence[float]) -> list[float]:
    """Return for each map the largest alpha_k [1/s] with M_k' P M_k <= exp(-2 alpha_k h_k) P."""
    return step_rates_per_s([P], [Step(0, 0, M, h_s) for M, h_s in zip(maps, periods_s, strict=True)])


def step_rates_per_s(P: Sequence[Floats], steps: Sequence[Step]) -> list[float]:
    """Return for each step the largest alpha_k [1/s] with M_k' P_after M_k <= exp(-2 alpha_k h_k) P_before."""
    inverses = [np.linalg.inv(np.linalg.cholesky(each)) for each in P]
    growth = [np.linalg.norm(inverses[step.before] @ step.M.T @ P[step.after] @ step.M @ inverses[step.before].T, 2)
              for step in steps]
    return [-float(np.log(g)) / (2 * step.duration_s) for g, step in zip(growth, steps, strict=True)]


def discrete_lyapunov(M: Floats, Q: Floats) -> Floats:
    """X = M' X M + Q for a contracting M."""
    from scipy.linalg import solve_discrete_lyapunov  # here, so that importing this file does not load it

    radius = float(np.abs(np.linalg.eigvals(M)).max())
    if radius >= 1:
        raise ValueError(f"spectral radius {radius:.9g}: only a contracting map has a Lyapunov function")
    X = np.asarray(solve_discrete_lyapunov(M.T, Q), dtype=np.float64)
    return (X + X.T) / 2


def search(maps: Sequence[Floats], periods_s: Sequence[float]) -> Floats:
    """Return the P with the greatest common alpha found, scaled to a smallest eigenvalue of 1; alpha may be negative.

    Raises ValueError unless every map is contracting (spectral radius below 1), as the initial P requires.
    """
    return search_several([Step(0, 0, M, h_s) for M, h_s in zip(maps, periods_s, strict=True)], maps)[0]


def search_several(steps: Sequence[Step], contracting: Sequence[Floats]) -> list[Floats]:
    """Return the functions with the greatest common alpha found, scaled together to a smallest eigenvalue of 1.

    The search runs in coordinates in which the functions of the maps `contracting` are round on average; ValueError
    unless each of these has a spectral radius below 1."""
    start = sum((X / np.trace(X) for X in (_own_function(M) for M in contracting)), np.zeros_like(contracting[0]))
    to_balanced = np.linalg.cholesky(start).T
    from_balanced = np.linalg.inv(to_balanced)
    found = _centers([step._replace(M=to_balanced @ step.M @ from_balanced) for step in steps])
    several = [to_balanced.T @ P @ to_balanced for P in found]
    smallest = min(float(np.linalg.eigvalsh(P)[0]) for P in several)
    return [(P + P.T) / (2 * smallest) for P in several]


def _own_function(M: Floats) -> Floats:
    radius = float(np.abs(np.linalg.eigvals(M)).max())
    if radius >= 1:
        raise ValueError(f"a round map has spectral radius {radius:.9g}: no topology may be unstable by itself")
    return discrete_lyapunov(M / np.sqrt(radius), np.eye(len(M)))


def _centers(steps: Sequence[Step]) -> Floats:
    functions = 1 + max(max(step.before, step.after) for step in steps)
    P = np.stack([np.eye(len(steps[0].M))] * functions)
    allowed = min(step_rates_per_s([*P], steps))
    alpha = allowed - max(abs(allowed), 1.0)
    for _ in range(MAX_STEPS):
        P = _newton(P, steps, [float(np.exp(-2 * alpha * step.duration_s)) for step in steps])
        gain = STEP * (min(step_rates_per_s([*P], steps)) - alpha)
        alpha += gain
        if gain < RELATIVE_GAIN * abs(alpha):
            break
    return P


def _newton(P: Floats, steps: Sequence[Step], factors: Sequence[float]) -> Floats:
    """Return the analytic center of the set of P, stacked, with every F_k > 0, by Newton's method from one inside."""
    functions, basis = len(P), _symmetric_basis(P.shape[1])
    size = len(basis)
    rows, columns = np.triu_indices(P.shape[1])
    weights = np.where(rows == columns, 1.0, np.sqrt(2.0))          # the inner product of symmetric matrices
    # Each constraint with the functions that it depends on, and its derivatives by their coordinates.
    slopes: list[dict[int, Floats]] = [{i: basis} for i in range(functions)]
    for step, factor in zip(steps, factors, strict=True):
        slope = {step.before: factor * basis}
        slope[step.after] = slope.get(step.after, 0.0) - step.M.T @ basis @ step.M
        slopes.append(slope)

    def constraints(at: Floats) -> list[Floats]:
        return [*at, *(factor * at[step.before] - step.M.T @ at[step.after] @ step.M
                       for step, factor in zip(steps, factors, strict=True))]

    def value(at: Floats) -> float:
        try:
            roots = [np.linalg.cholesky(F) for F in constraints(at)]
        except np.linalg.LinAlgError:
            return np.inf
        return float(np.trace(at, axis1=1, axis2=2).sum() - 2 * sum(np.log(np.diag(root)).sum() for root in roots))

    for _ in range(MAX_NEWTON_STEPS):
        gradient = np.tile(np.trace(basis, axis1=1, axis2=2), (functions, 1))
        hessian = np.zeros((functions, size, functions, size))
        for F, slope in zip(constraints(P), slopes, strict=True):
            inverse = np.linalg.inv(np.linalg.cholesky(F))
            scaled = {i: inverse @ each @ inverse.T for i, each in slope.items()}
            flat = {i: each[:, rows, columns] * weights for i, each in scaled.items()}
            for i in scaled:
                gradient[i] -= np.trace(scaled[i], axis1=1, axis2=2)
                for j in scaled:
                    hessian[i, :, j] += flat[i] @ flat[j].T
        step_flat = -np.linalg.solve(hessian.reshape(functions * size, -1), gradient.ravel())
        decrement = float(-gradient.ravel() @ step_flat)
        if decrement < 1e-3:        # the next center need not be exact
            break
        direction = np.tensordot(step_flat.reshape(functions, size), basis, 1)
        length, before = 1.0, value(P)
        while value(P + length * direction) > before - 0.1 * length * decrement:
            length /= 2
        P = P + length * direction
    return P


def _symmetric_basis(n: int) -> NDArray[np.float64]:
    """Return n (n + 1) / 2 orthonormal symmetric n x n matrices, stacked."""
    stacked = []
    for i in range(n):
        for j in range(i, n):
            E = np.zeros((n, n))
            E[i, j] = E[j, i] = 1.0 if i == j else np.sqrt(0.5)
            stacked.append(E)
    return np.array(stacked)
