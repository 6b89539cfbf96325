"""Search for one quadratic function that decays under every one of several linear maps.

    maximize alpha   subject to   P > 0,   F_k = exp(-2 alpha h_k) P - M_k' P M_k > 0   for all k

This generalized eigenvalue problem is quasi-convex, and is solved by the method of centers (Boyd and El Ghaoui 1993):
alpha grows by the part STEP towards the largest value that P allows, then Newton's method minimizes
tr P - log det P - sum log det F_k. `dwell_time.CommonCertificate` checks the result by eigenvalues, independently.

Not modelled: a proof that no P exists if none is found; functions other than quadratic ones.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from agents.synchronization.graph import Floats

STEP = 0.8                  # share of the possible increase of alpha; any value in (0, 1) converges
RELATIVE_GAIN = 1e-4        # the search stops when a step improves alpha by a smaller share of it
MAX_STEPS = 200
MAX_NEWTON_STEPS = 50


def rates_per_s(P: Floats, maps: Sequence[Floats], periods_s: Sequence[float]) -> list[float]:
    """Return for each map the largest alpha_k [1/s] with M_k' P M_k <= exp(-2 alpha_k h_k) P."""
    inverse = np.linalg.inv(np.linalg.cholesky(P))
    growth = [np.linalg.norm(inverse @ M.T @ P @ M @ inverse.T, 2) for M in maps]
    return [-float(np.log(g)) / (2 * h_s) for g, h_s in zip(growth, periods_s, strict=True)]


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
    start = sum((X / np.trace(X) for X in (_own_function(M) for M in maps)), np.zeros_like(maps[0]))
    to_balanced = np.linalg.cholesky(start).T
    from_balanced = np.linalg.inv(to_balanced)
    balanced = [to_balanced @ M @ from_balanced for M in maps]
    P = to_balanced.T @ _centers(balanced, periods_s) @ to_balanced
    smallest: float = np.linalg.eigvalsh(P)[0]
    return (P + P.T) / (2 * smallest)


def _own_function(M: Floats) -> Floats:
    radius = float(np.abs(np.linalg.eigvals(M)).max())
    if radius >= 1:
        raise ValueError(f"a round map has spectral radius {radius:.9g}: no topology may be unstable by itself")
    return discrete_lyapunov(M / np.sqrt(radius), np.eye(len(M)))


def _centers(maps: Sequence[Floats], periods_s: Sequence[float]) -> Floats:
    P = np.eye(len(maps[0]))
    allowed = min(rates_per_s(P, maps, periods_s))
    alpha = allowed - max(abs(allowed), 1.0)
    for _ in range(MAX_STEPS):
        P = _newton(P, maps, [float(np.exp(-2 * alpha * h_s)) for h_s in periods_s])
        gain = STEP * (min(rates_per_s(P, maps, periods_s)) - alpha)
        alpha += gain
        if gain < RELATIVE_GAIN * abs(alpha):
            break
    return P


def _newton(P: Floats, maps: Sequence[Floats], factors: Sequence[float]) -> Floats:
    """Return the analytic center of the set of P with every F_k > 0, by Newton's method from a P inside."""
    basis = _symmetric_basis(len(P))
    images = [basis, *(f * basis - M.T @ basis @ M for M, f in zip(maps, factors, strict=True))]

    def constraints(at: Floats) -> list[Floats]:
        return [at, *(f * at - M.T @ at @ M for M, f in zip(maps, factors, strict=True))]

    def value(at: Floats) -> float:
        try:
            roots = [np.linalg.cholesky(F) for F in constraints(at)]
        except np.linalg.LinAlgError:
            return np.inf
        return float(np.trace(at) - 2 * sum(np.log(np.diag(root)).sum() for root in roots))

    for _ in range(MAX_NEWTON_STEPS):
        gradient = np.trace(basis, axis1=1, axis2=2)
        hessian = np.zeros((len(basis), len(basis)))
        for F, image in zip(constraints(P), images, strict=True):
            inverse = np.linalg.inv(np.linalg.cholesky(F))
            scaled = inverse @ image @ inverse.T
            gradient = gradient - np.trace(scaled, axis1=1, axis2=2)
            flat = scaled.reshape(len(basis), -1)
            hessian += flat @ flat.T
        step = -np.linalg.solve(hessian, gradient)
        decrement = float(-gradient @ step)
        if decrement < 1e-3:        # the next center need not be exact
            break
        direction = np.tensordot(step, basis, 1)
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
