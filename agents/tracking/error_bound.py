"""Matrices A with |g| <= A |e| + y~ (4.25) for the tracking loop, and the growth rates of the error that they allow.

With |x1| <= M1, |x2| <= M2, |x3| <= M3 and v = |v^_R2|, row by row, each entry as small as can be:

        [ k1   k2 v M2   a13   ]      the symmetric matrix of (4.47) takes the larger of each two
        [ 0    k2 v M1   k3 M1 ]      entries across the diagonal
        [ 0    k2 v      k3    ]

All entries but a13 are necessary, as e going to infinity along one axis shows, and sufficient by the triangle
inequality. So the program (4.32) has an entrywise least element, and the norm of a nonnegative matrix grows with every
entry. `heading_slope` computes a13. (4.27) and (4.28) use only the growth of ||exp(A t)||; there are four bounds of it:

    PRINTED           a13 = max(|v|, k3 M2), the norm of the symmetric matrix. Not valid: for comparison only
    CLOSED_FORM       a13 = |v| + k3 M2, the same norm
    LEAST             a13 of `heading_slope`, the same norm: the optimum of (4.32)
    LOGARITHMIC_NORM  lambda_max((A + A') / 2) of the matrix above, not made symmetric: ||exp(A t)|| <= exp(that t)

Differs from the dissertation: (4.47) prints the maximum in (1, 3). At v = 1, omega = 0, x = (0, 0.1, pi/2 - 0.5),
e = (0, 0, 1) and M2 = 0.1 its first row is violated; the sum is correct. (4.32b) requires a symmetric A, which
Theorem 3 does not need.
"""

from __future__ import annotations

from enum import Enum
from math import sqrt

from agents.tracking.controller import TrackingController
from agents.tracking.heading_slope import HeadingSlope
from agents.tracking.reachable_set import Extents
from firmware_sim.shared_functions import arc_cosine, cosine

Matrix = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]


class Bound(Enum):
    PRINTED = "printed"
    CLOSED_FORM = "closed form"
    LEAST = "least"
    LOGARITHMIC_NORM = "logarithmic norm"


class ErrorBound:
    def __init__(self, controller: TrackingController, bound: Bound = Bound.LEAST) -> None:
        self.controller, self.bound = controller, bound
        self._k1, self._k2, self._k3 = controller.k1_per_s, controller.k2_per_m2, controller.k3_per_s
        self._heading_slope = HeadingSlope(self._k2, self._k3)

    def rows(self, v_mps: float, extents: Extents) -> Matrix:
        """Return the matrix of the module's docstring, row by row and not symmetric; PRINTED differs in (1, 3)."""
        m1, m2, _ = extents
        v = abs(v_mps)
        k2v, k3 = self._k2 * v, self._k3
        return (self._k1, k2v * m2, self._a13(v, extents)), (0.0, k2v * m1, k3 * m1), (0.0, k2v, k3)

    def matrix(self, v_mps: float, extents: Extents) -> Matrix:
        """Return the symmetric A of (4.47) and of the program (4.32)."""
        (a11, a12, a13), (_, a22, a23), (_, a32, a33) = self.rows(v_mps, extents)
        a23 = max(a23, a32)
        return (a11, a12, a13), (a12, a22, a23), (a13, a23, a33)

    def growth_per_s(self, v_mps: float, extents: Extents) -> float:
        """Return the growth rate [1/s] used for ||A|| in (4.28), metres and radians weighted alike."""
        m1, m2, _ = extents
        v = abs(v_mps)
        k2v, k3 = self._k2 * v, self._k3
        a12, a13, a23, a32 = k2v * m2, self._a13(v, extents), k3 * m1, k2v
        if self.bound is Bound.LOGARITHMIC_NORM:
            return largest_eigenvalue(self._k1, k2v * m1, k3, a12 / 2, a13 / 2, (a23 + a32) / 2)
        return largest_eigenvalue(self._k1, k2v * m1, k3, a12, a13, a23 if a23 > a32 else a32)

    def _a13(self, v: float, extents: Extents) -> float:
        if self.bound is Bound.CLOSED_FORM:
            return v + self._k3 * extents[1]
        if self.bound is Bound.PRINTED:
            return max(v, self._k3 * extents[1])
        return self._heading_slope(v, extents[1], extents[2])


def largest_eigenvalue(a11: float, a22: float, a33: float, a12: float, a13: float, a23: float) -> float:
    """Return the largest eigenvalue of a symmetric 3 x 3 matrix (Smith 1961): its 2-norm if no entry < 0 (Lemma 2).

    Relative error below 3e-8, and 1e-14 where the largest eigenvalue is simple, for entries of up to 1e100.
    """
    mean = (a11 + a22 + a33) / 3
    b11, b22, b33 = a11 - mean, a22 - mean, a33 - mean
    off = a12 * a12 + a13 * a13 + a23 * a23
    size = sqrt((b11 * b11 + b22 * b22 + b33 * b33 + 2 * off) / 6)
    cube = 2 * size * size * size
    if cube == 0:
        return mean + 2 * size
    determinant = (b11 * (b22 * b33 - a23 * a23) - a12 * (a12 * b33 - a23 * a13) + a13 * (a12 * a23 - b22 * a13))
    ratio = determinant / cube
    if ratio >= 1:
        return mean + 2 * size
    return mean + 2 * size * cosine(arc_cosine(ratio if ratio > -1 else -1.0) / 3)
