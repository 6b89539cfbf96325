"""The convex program (4.32) for any error dynamics: the smallest ||A|| among symmetric A >= 0 that bound given samples.

    minimize ||A||  subject to  A = A' >= 0 entrywise,  |g_k| - y~_k <= A |e_k|  for each sample k

Linear constraints and a convex objective: Kelley's cutting planes (1960) over linear programs (HiGHS). For a
nonnegative symmetric A the norm is the largest z'A z over unit z >= 0, so every eigenvector found is a cut.

Finitely many samples relax (4.32c), so the optimum found is a lower bound of the program's, and the matrix found need
not be valid between samples. The bound shows how far a matrix in closed form is from the optimum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MOST_CUTS = 200


@dataclass(frozen=True, eq=False)
class LeastNorm:
    lower: float        # lower bound of the norm of every symmetric A >= 0 that satisfies the samples
    matrix: Floats      # an A that satisfies the samples
    upper: float        # upper bound of the norm of `matrix`


def least_norm(error_magnitudes: Floats, required: Floats, *, accuracy: float = 1e-4) -> LeastNorm:
    """Solve the program for samples |e| and |g| - y~, each of shape (samples, n), to a relative `accuracy`.

    Raises ValueError for bad samples, or if no A satisfies them."""
    from scipy.optimize import linprog  # here: a robot that only decides does not load SciPy

    errors, needed = np.asarray(error_magnitudes, dtype=np.float64), np.asarray(required, dtype=np.float64)
    if errors.ndim != 2 or errors.shape != needed.shape or not len(errors):
        raise ValueError(f"samples of shape {errors.shape} and {needed.shape}: expected two equal shapes (samples, n)")
    if not (np.isfinite(errors).all() and np.isfinite(needed).all() and (errors >= 0).all()):
        raise ValueError("samples are not finite, or a magnitude |e| is negative")
    n = errors.shape[1]
    place = {pair: k for k, pair in enumerate((i, j) for i in range(n) for j in range(i, n))}
    rows, sides = [], []
    for i in range(n):
        asked = needed[:, i] > 0
        scale = np.maximum(np.linalg.norm(errors[asked], axis=1), 1e-300)[:, None]
        block = np.zeros((int(asked.sum()), len(place) + 1))
        for j in range(n):
            block[:, place[min(i, j), max(i, j)]] = -errors[asked, j] / scale[:, 0]
        rows.append(block)
        sides.append(-needed[asked, i] / scale[:, 0])
    cost = np.zeros(len(place) + 1)
    cost[-1] = 1.0
    cuts = [_cut(np.eye(n)[i], place) for i in range(n)] + [_cut(np.ones(n) / n**0.5, place)]
    best: LeastNorm | None = None
    for _ in range(MOST_CUTS):
        found = linprog(cost, A_ub=np.vstack([*rows, *cuts]), b_ub=np.concatenate([*sides, np.zeros(len(cuts))]),
                        bounds=(0, None), method="highs")
        if found.status != 0 or found.x is None or found.fun is None:
            raise ValueError(f"no symmetric A >= 0 satisfies the samples: {found.message}")
        A = np.zeros((n, n))
        for (i, j), k in place.items():
            A[i, j] = A[j, i] = found.x[k]
        values, vectors = np.linalg.eigh(A)
        upper = float(values[-1])
        best = LeastNorm(float(found.fun), A if best is None or upper < best.upper else best.matrix,
                         upper if best is None else min(upper, best.upper))
        if best.upper - best.lower <= accuracy * max(best.upper, 1e-12):
            return best
        cuts.append(_cut(np.abs(vectors[:, -1]), place))
    assert best is not None
    return best


def _cut(z: Floats, place: dict[tuple[int, int], int]) -> Floats:
    """Return the cut z'A z <= t as a row over (entries of A, t)."""
    row = np.zeros((1, len(place) + 1))
    for (i, j), k in place.items():
        row[0, k] = z[i] * z[j] * (1 if i == j else 2)
    row[0, -1] = -1.0
    return row
