"""Unscented Kalman filter for a unicycle that is detected at irregular times.

    state (x, y, theta)     one Euler step over the gap:  x + dt v cos theta,  y + dt v sin theta,  theta + dt omega
    sigma points  m, m +- columns of the Cholesky factor of (L + lambda) P,   lambda = alpha^2 (L + kappa) - L,  L = 3
    update: the propagated points give mean and covariance P + Q (once), then the linear update with the position

Written in plain floats: for 3 x 3 matrices NumPy's overhead per call would dominate. Headings are not wrapped.
Source: E. A. Wan, R. van der Merwe, "The unscented Kalman filter for nonlinear estimation", 2000; the dissertation's
section 3.4 compares with it, its tuning is that of NUMBERS.
"""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import NamedTuple

from agents.estimation import Inputs, Order

L = 3


class Tuning(NamedTuple):
    alpha: float = 1.0
    beta: float = 2.0
    kappa: float = 0.0
    process_m2: float = 0.01        # Q = process_m2 I [m^2, m^2, rad^2], once per update
    measured_m2: float = 0.01       # R = measured_m2 I


class UnscentedKalman:
    def __init__(self, mean: tuple[float, float, float], variances: tuple[float, float, float], t_ns: int = 0,
                 inputs: Inputs = Inputs(0.0, 0.0), tuning: Tuning = Tuning()) -> None:
        """Start at t_ns from `mean` (x, y, theta) [m, m, rad]; `variances`, the covariance's diagonal, are above 0."""
        if not all(variance > 0 for variance in variances):
            raise ValueError(f"variances={variances}: expected more than 0 each")
        if not (tuning.process_m2 >= 0 and tuning.measured_m2 > 0 and tuning.alpha > 0 and L + tuning.kappa > 0):
            raise ValueError(f"{tuning}: expected process_m2 >= 0, measured_m2 > 0, alpha > 0, kappa > -3")
        self.mean = mean
        self.covariance = ((variances[0], 0.0, 0.0), (0.0, variances[1], 0.0), (0.0, 0.0, variances[2]))
        self._t_ns = t_ns
        self._inputs = inputs
        self._tuning = tuning
        spread = tuning.alpha ** 2 * (L + tuning.kappa)             # L + lambda
        self._spread = spread
        self._mean_weight = (spread - L) / spread                   # weight of the middle sigma point in the mean
        self._middle_weight = self._mean_weight + 1 - tuning.alpha ** 2 + tuning.beta
        self._weight = 0.5 / spread
        self._order = Order()

    def expect(self, t_ns: int) -> tuple[float, float]:
        self._order.check_question(t_ns, self._t_ns)
        x, y, _ = self._mean_of(self._propagated((t_ns - self._t_ns) * 1e-9))
        return x, y

    def correct(self, t_ns: int, x_m: float, y_m: float, inputs: Inputs | None = None) -> bool:
        if not self._order.accepts(t_ns, x_m, y_m) or t_ns < self._t_ns:
            return False
        points = self._propagated((t_ns - self._t_ns) * 1e-9)
        mx, my, mh = self._mean_of(points)
        xx = yy = hh = self._tuning.process_m2
        xy = xh = yh = 0.0
        weight = self._middle_weight
        for x, y, h in points:
            dx, dy, dh = x - mx, y - my, h - mh
            wx, wy = weight * dx, weight * dy
            xx += wx * dx
            xy += wx * dy
            xh += wx * dh
            yy += wy * dy
            yh += wy * dh
            hh += weight * dh * dh
            weight = self._weight
        # S = P[:2, :2] + R,  K = P[:, :2] S^-1,  P - K S K' = P - K P[:2, :]
        sxx, syy = xx + self._tuning.measured_m2, yy + self._tuning.measured_m2
        determinant = sxx * syy - xy * xy
        kxx, kxy = (xx * syy - xy * xy) / determinant, (xy * sxx - xx * xy) / determinant
        kyx, kyy = (xy * syy - yy * xy) / determinant, (yy * sxx - xy * xy) / determinant
        khx, khy = (xh * syy - yh * xy) / determinant, (yh * sxx - xh * xy) / determinant
        ax, ay = x_m - mx, y_m - my
        self.mean = mx + kxx * ax + kxy * ay, my + kyx * ax + kyy * ay, mh + khx * ax + khy * ay
        pxy, pxh, pyh = xy - kxx * xy - kxy * yy, xh - kxx * xh - kxy * yh, yh - kyx * xh - kyy * yh
        self.covariance = ((xx - kxx * xx - kxy * xy, pxy, pxh), (pxy, yy - kyx * xy - kyy * yy, pyh),
                           (pxh, pyh, hh - khx * xh - khy * yh))
        self._t_ns = self._order.last_ns = t_ns
        if inputs is not None:
            self._inputs = inputs
        return True

    def _mean_of(self, points: list[tuple[float, float, float]]) -> tuple[float, float, float]:
        middle, *others = points
        share, weight = self._mean_weight, self._weight
        return (share * middle[0] + weight * sum([point[0] for point in others]),
                share * middle[1] + weight * sum([point[1] for point in others]),
                share * middle[2] + weight * sum([point[2] for point in others]))

    def _propagated(self, dt_s: float) -> list[tuple[float, float, float]]:
        """Return the sigma points after one Euler step of dt_s, the middle one first."""
        (xx, xy, xh), (_, yy, yh), (_, _, hh) = self.covariance
        a = sqrt(self._spread)
        lxx = sqrt(xx)                                              # lower triangular Cholesky factor
        lyx, lhx = xy / lxx, xh / lxx
        lyy = sqrt(yy - lyx * lyx)
        lhy = (yh - lhx * lyx) / lyy
        lhh = sqrt(hh - lhx * lhx - lhy * lhy)
        x, y, h = self.mean
        v, omega = self._inputs
        way, turn = dt_s * v, dt_s * omega
        return [(px + way * cos(ph), py + way * sin(ph), ph + turn) for px, py, ph in (
            (x, y, h), (x + a * lxx, y + a * lyx, h + a * lhx), (x, y + a * lyy, h + a * lhy), (x, y, h + a * lhh),
            (x - a * lxx, y - a * lyx, h - a * lhx), (x, y - a * lyy, h - a * lhy), (x, y, h - a * lhh))]
