"""Least-squares circle through points that may lie on a line (Pratt 1987), and the least-squares line.

Pratt's fit minimizes sum (A z + B x + C y + D)^2, z = x^2 + y^2, under B^2 + C^2 - 4 A D = 1: near the curve this is
the squared distance, and a line is A = 0. Curvature is 2 A. Here coordinates start at the mean, go along the
principal axes (x the longer one: Mxy = 0) and are scaled to mean z = 1. Then B and D are eliminated,

    [ a(h)  Mzy ] [A]                  a(h) = Mzz - (1 + 2 h)^2 - Mzx^2 / (lx - h)
    [ Mzy  ly-h ] [C] = 0              h: smallest root >= 0 of the determinant, by Newton from 0 (Chernov 2010, 5.7)

and the larger row gives the null vector: no division by what vanishes for a line (Mzy, ly) or a full circle (a, Mzy).

Differs from the dissertation: [93] fits an algebraic curve of order 4; Kasa's fit, the simplest of that kind, fails on
straight data.
Source: V. Pratt, Direct least-squares fitting of algebraic surfaces, 1987; N. Chernov, Circular and Linear
Regression, 2010.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, sqrt
from typing import NamedTuple

from agents.estimation.curve import Curve

Point = tuple[float, float]

NEWTON_STEPS = 30               # Newton's method takes 3 to 6; more break an invariant
NEWTON_RELATIVE = 1e-13


class Fit(NamedTuple):
    circle: Curve               # p0 is its point nearest to the mean of the points; the direction is arbitrary
    line: Curve                 # through the mean
    circle_rss_m2: float        # sum of squared distances
    line_rss_m2: float


def fit(points: Sequence[Point]) -> Fit:
    """Return circle and line through at least 3 points, in O(len(points)); ValueError for fewer.

    For points that all coincide the line is parallel to the x axis."""
    n = len(points)
    if n < 3:
        raise ValueError(f"{n} points: a circle needs 3 or more")
    mean_x = sum([x for x, _ in points]) / n
    mean_y = sum([y for _, y in points]) / n
    sxx = sxy = syy = sxz = syz = szz = 0.0
    for x, y in points:
        x -= mean_x
        y -= mean_y
        xx, yy = x * x, y * y
        z = xx + yy
        sxx += xx
        syy += yy
        sxy += x * y
        sxz += x * z
        syz += y * z
        szz += z * z
    size2 = (sxx + syy) / n                     # mean z
    if not size2 > 0.0:
        still = Curve(mean_x, mean_y, 1.0, 0.0, 0.0)
        return Fit(still, still, 0.0, 0.0)

    half = 0.5 * (sxx - syy)                    # principal axes of the scatter matrix
    spread = hypot(half, sxy)
    if half >= 0.0:
        ux, uy = half + spread, sxy
    else:
        ux, uy = abs(sxy), (spread - half) if sxy >= 0.0 else half - spread
    norm = hypot(ux, uy)
    ux, uy = (ux / norm, uy / norm) if norm else (1.0, 0.0)
    trace = sxx + syy
    lx = 0.5 + spread / trace                   # eigenvalues, scaled: lx + ly = 1
    ly = max((sxx * syy - sxy * sxy) / (trace * trace * lx), 0.0)
    scale3 = n * size2 * sqrt(size2)
    mzx = (ux * sxz + uy * syz) / scale3
    mzy = (ux * syz - uy * sxz) / scale3
    mzz = szz / (n * size2 * size2)

    h = _smallest_root(lx, ly, mzx, mzy, mzz)
    a11 = mzz - (1.0 + 2.0 * h) ** 2 - mzx * mzx / (lx - h) if lx > h else 0.0
    a22 = ly - h
    if abs(a11) >= abs(a22):
        A, C = -mzy, a11
    else:
        A, C = a22, -mzy
    B = -mzx * A / (lx - h) if lx > h else 0.0
    D = -(1.0 + 2.0 * h) * A
    line = Curve(mean_x, mean_y, ux, uy, 0.0)
    weight = sqrt(max(B * B + C * C - 4.0 * A * D, 0.0))
    if not weight > 0.0:                        # two places only: every circle through them fits, and the line
        return Fit(line, line, ly * trace, ly * trace)
    A, B, C, D = A / weight, B / weight, C / weight, D / weight

    # foot of the mean (0, 0): along the gradient (B, C), at the distance that follows from D
    slope = hypot(B, C)
    if slope > 1e-12:
        gx, gy = B / slope, C / slope
    else:
        gx, gy = 0.0, 1.0                       # the mean is the centre: any foot will do
    away = -2.0 * D / (1.0 + slope)
    root = sqrt(size2)
    px, py = away * gx * root, away * gy * root
    # the gradient at the foot has length 1; the tangent is its right-hand normal, so that left is along the gradient
    circle = Curve(mean_x + ux * px - uy * py, mean_y + uy * px + ux * py,
                   ux * gy + uy * gx, uy * gy - ux * gx, -2.0 * A / root)
    rss = 0.0
    for x, y in points:
        rss += circle.distance_m(x, y) ** 2
    return Fit(circle, line, rss, ly * trace)


def _smallest_root(lx: float, ly: float, mzx: float, mzy: float, mzz: float) -> float:
    """Return the least h >= 0 with (ly - h)(lx - h)(mzz - (1 + 2 h)^2) - mzx^2 (ly - h) - mzy^2 (lx - h) = 0."""
    x2, y2 = mzx * mzx, mzy * mzy
    h = 0.0
    for _ in range(NEWTON_STEPS):
        p, q, r = ly - h, lx - h, 1.0 + 2.0 * h
        w = mzz - r * r
        value = p * q * w - x2 * p - y2 * q
        slope = -q * w - p * w - 4.0 * r * p * q + x2 + y2
        if value <= 0.0 or slope >= 0.0:        # rounding: the points lie on the curve
            return h
        step = -value / slope
        h += step
        if step <= NEWTON_RELATIVE * h:
            return min(h, ly)
    return min(h, ly)
