"""exp(M) of a small matrix by scaling and squaring with the [13/13] Pade approximant (Higham 2005, algorithm 2.3).

Not modelled: the lower orders and the preprocessing of Higham's algorithm, which only save time.
"""

from __future__ import annotations

from math import ceil, log2

import numpy as np

from agents.synchronization.graph import Floats

THETA_13 = 5.371920351148152        # 1-norm up to which the approximant is exact to double precision
B = (64764752532480000.0, 32382376266240000.0, 7771770303897600.0, 1187353796428800.0, 129060195264000.0,
     10559470521600.0, 670442572800.0, 33522128640.0, 1323241920.0, 40840800.0, 960960.0, 16380.0, 182.0, 1.0)


def matrix_exponential(M: Floats) -> Floats:
    norm = float(np.linalg.norm(M, 1))
    squarings = max(0, ceil(log2(norm / THETA_13))) if norm > 0 else 0
    A = M / 2.0**squarings
    one, A2 = np.eye(len(A)), A @ A
    A4 = A2 @ A2
    A6 = A4 @ A2
    odd = A @ (A6 @ (B[13] * A6 + B[11] * A4 + B[9] * A2) + B[7] * A6 + B[5] * A4 + B[3] * A2 + B[1] * one)
    even = A6 @ (B[12] * A6 + B[10] * A4 + B[8] * A2) + B[6] * A6 + B[4] * A4 + B[2] * A2 + B[0] * one
    result = np.asarray(np.linalg.solve(even - odd, even + odd), dtype=np.float64)
    for _ in range(squarings):
        result = result @ result
    return result


def held_input_step(A: Floats, B: Floats, h_s: float) -> tuple[Floats, Floats]:
    """Return exp(A h) and the integral of exp(A s) B over [0, h]: the step of x' = A x + B u with u held."""
    states, inputs = B.shape
    grown = matrix_exponential(np.block([[A, B], [np.zeros((inputs, states + inputs))]]) * h_s)
    return grown[:states, :states], grown[:states, states:]
