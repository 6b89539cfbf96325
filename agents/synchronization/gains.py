"""The two gains of the small-gain condition: A* (6.18) and the L2-gain gamma of (6.13) from (e, omega) to y~ (6.19).

gamma is the H-infinity norm of G(s) = C (sI - A)^-1 B + D, where (section 6.5)

    A = A_cl,   B = [B_cl  B_d],   C = C_cl A_cl,   D = C_cl [0  B_d]

It is found by bisection on the imaginary eigenvalues of a Hamiltonian matrix (Boyd, Balakrishnan and Kabamba 1989),
with the faster two-step search of Bruinsma and Steinbuch (1990): gamma > sigma_max(D) is an upper bound exactly when

    [ A + B R^-1 D'C              B R^-1 B'       ]
    [ -C'(I + D R^-1 D')C   -(A + B R^-1 D'C)'    ],   R = gamma^2 I - D'D,   has no eigenvalue on the imaginary axis.

Not modelled: L_p gains for p other than 2; outward rounding (the bracket is that of double precision arithmetic).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.synchronization.closed_loop import ClosedLoop
from agents.synchronization.graph import Floats

RELATIVE_ACCURACY = 1e-8
NEAR_THE_AXIS = 1e-4        # |Re| / |lambda| below which an eigenvalue may be a crossing; sigma_max then decides


@dataclass(frozen=True)
class HInfinityNorm:
    """lower <= norm <= upper, (upper - lower) / lower = RELATIVE_ACCURACY; lower is attained at `peak_rad_s`."""

    lower: float
    upper: float
    peak_rad_s: float


def sigma_max(A: Floats, B: Floats, C: Floats, D: Floats, omega_rad_s: float) -> float:
    """Return the largest singular value of G(j omega); of D for omega = inf."""
    if np.isinf(omega_rad_s):
        return float(np.linalg.norm(D, 2))
    response = C @ np.linalg.solve(1j * omega_rad_s * np.eye(len(A)) - A, B) + D
    return float(np.linalg.norm(response, 2))


def h_infinity_norm(A: Floats, B: Floats, C: Floats, D: Floats) -> HInfinityNorm:
    """Return the H-infinity norm of G(s); raises ValueError, with the eigenvalue, if A is not Hurwitz."""
    poles = np.linalg.eigvals(A)
    worst = poles[np.argmax(poles.real)]
    if worst.real >= 0:
        raise ValueError(f"A has the eigenvalue {worst:.6g}: only a Hurwitz matrix has a finite gain (Assumption 6)")
    starts = [0.0, np.inf, *np.abs(poles).tolist(), *np.abs(poles.imag).tolist()]
    lower, peak = max((sigma_max(A, B, C, D, w), w) for w in starts)
    if lower == 0.0:
        return HInfinityNorm(0.0, 0.0, 0.0)
    while True:
        upper = lower * (1 + RELATIVE_ACCURACY)
        crossings = _near_crossings(A, B, C, D, upper)
        between = (crossings[1:] + crossings[:-1]) / 2
        tried = [(sigma_max(A, B, C, D, w), w) for w in (*crossings.tolist(), *between.tolist())]
        best, at = max(tried, default=(0.0, 0.0))
        if not best > upper:
            return HInfinityNorm(lower, upper, peak)
        lower, peak = best, at


def _near_crossings(A: Floats, B: Floats, C: Floats, D: Floats, gamma: float) -> Floats:
    """Return the frequencies [rad/s], ascending, at which a singular value of G may equal gamma."""
    R_inv = np.linalg.inv(gamma**2 * np.eye(B.shape[1]) - D.T @ D)
    corner = A + B @ R_inv @ D.T @ C
    hamiltonian = np.block([[corner, B @ R_inv @ B.T],
                            [-C.T @ (np.eye(C.shape[0]) + D @ R_inv @ D.T) @ C, -corner.T]])
    values = np.linalg.eigvals(hamiltonian)
    near = np.abs(values.real) <= NEAR_THE_AXIS * np.abs(values)
    frequencies = np.sort(np.abs(values[near].imag))
    return frequencies[np.diff(frequencies, prepend=-1.0) > 0]      # np.unique would import numpy.ma, a fifth of numpy


def l2_gain(loop: ClosedLoop) -> HInfinityNorm:
    """Return gamma of Theorem 9, from (e, omega) to y~ = C_cl (A_cl x + B_d omega) (6.17)-(6.19), Remark 17."""
    B = np.hstack([loop.B_cl, loop.B_d])
    D = loop.C_cl @ np.hstack([np.zeros_like(loop.B_cl), loop.B_d])
    return h_infinity_norm(loop.A_cl, B, loop.C_cl @ loop.A_cl, D)


def error_growth(loop: ClosedLoop) -> Floats:
    """Return |C_cl B_cl| entrywise, which bounds (6.17) as A* does but is not made symmetric."""
    return np.abs(loop.C_cl @ loop.B_cl)


def a_star(loop: ClosedLoop) -> Floats:
    """Return A* = [max(|c_ij|, |c_ji|)] with [c_ij] = -C_cl B_cl (6.18)."""
    growth = error_growth(loop)
    return np.maximum(growth, growth.T)
