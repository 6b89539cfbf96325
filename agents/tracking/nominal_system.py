"""The nominal tracking system Sigma_n with its adjoints, for `agents.triggering.l2_gain`.

    x' = f(x, e, e_omega) = -g of (4.46),   y~(x, e_omega) of (4.47),   inputs (e1, e2, e3, e_omega1, e_omega2)

for constant omega^_p. Where y~ is not differentiable, the derivative is taken as 0. Parts of y~ are quadratic in x, so
the gain grows with the amplitude and there is no finite L2-gain; near 0 the gain is that of a linear system with
outputs |a| + |b|.
"""

from __future__ import annotations

import numpy as np

from agents.tracking.controller import Inputs, TrackingController
from agents.triggering.l2_gain import Floats


class NominalTracking:
    states = 3
    inputs = 5

    def __init__(self, held: Inputs, controller: TrackingController | None = None) -> None:
        controller = controller or TrackingController()
        self._k1, self._k2, self._k3 = controller.k1_per_s, controller.k2_per_m2, controller.k3_per_s
        self._v, self._omega = held

    def rate(self, x: Floats, w: Floats) -> Floats:
        x1, x2, x3 = x
        e1, e2, e3, dv, domega = w
        phi = x3 + e3
        omega1 = self._omega + self._k2 * self._v * np.sinc(phi / np.pi) * (x2 + e2) + self._k3 * phi
        v1 = self._v * np.cos(phi) + self._k1 * (x1 + e1)
        v2 = self._v - dv
        return np.stack([omega1 * x2 - v1 + v2 * np.cos(x3), v2 * np.sin(x3) - omega1 * x1,
                         self._omega - domega - omega1])

    def output(self, x: Floats, w: Floats) -> Floats:
        x1, x2, _ = x
        k2v = self._k2 * abs(self._v)
        forward, sideways, turning = self._inner(x, w)
        return np.stack([k2v * x2 * x2 + np.abs(forward), k2v * np.abs(x1 * x2) + np.abs(sideways),
                         k2v * np.abs(x2) + np.abs(turning)])

    def rate_adjoint(self, x: Floats, w: Floats, p: Floats) -> tuple[Floats, Floats]:
        x1, x2, x3 = x
        _, e2, e3, dv, _ = w
        p1, p2, p3 = p
        phi, v2 = x3 + e3, self._v - dv
        sinc = np.sinc(phi / np.pi)
        omega1 = self._omega + self._k2 * self._v * sinc * (x2 + e2) + self._k3 * phi
        by_omega1, by_v1 = p1 * x2 - p2 * x1 - p3, -p1
        by_x1, by_x2 = self._k1 * by_v1, self._k2 * self._v * sinc * by_omega1
        slope = np.where(np.abs(phi) > 1e-4, (np.cos(phi) - sinc) / np.where(phi == 0, 1.0, phi), -phi / 3)
        by_phi = by_omega1 * (self._k2 * self._v * slope * (x2 + e2) + self._k3) - by_v1 * self._v * np.sin(phi)
        cos3, sin3 = np.cos(x3), np.sin(x3)
        of_state = np.stack([by_x1 - p2 * omega1, by_x2 + p1 * omega1, by_phi + v2 * (p2 * cos3 - p1 * sin3)])
        return of_state, np.stack([by_x1, by_x2, by_phi, -p1 * cos3 - p2 * sin3, -p3])

    def output_adjoint(self, x: Floats, w: Floats, q: Floats) -> tuple[Floats, Floats]:
        x1, x2, x3 = x
        dv = w[3]
        k2v, k3 = self._k2 * abs(self._v), self._k3
        q1, q2, q3 = q
        forward, sideways, turning = (q * np.sign(inner) for q, inner in zip(q, self._inner(x, w), strict=True))
        cos3, sin3 = np.cos(x3), np.sin(x3)
        of_state = np.stack([
            self._k1 * forward + (self._omega + k3 * x3) * sideways + k2v * q2 * np.abs(x2) * np.sign(x1),
            2 * k2v * q1 * x2 - (self._omega + k3 * x3) * forward + k2v * (q2 * np.abs(x1) + q3) * np.sign(x2),
            -(dv * sin3 + k3 * x2) * forward + (k3 * x1 - (self._v - dv) * cos3) * sideways + k3 * turning])
        zero = np.zeros_like(dv)
        return of_state, np.stack([zero, zero, zero, cos3 * forward + sin3 * sideways, turning])

    def _inner(self, x: Floats, w: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the terms of which (4.47) takes absolute values."""
        x1, x2, x3 = x
        dv, domega = w[3], w[4]
        return (self._k1 * x1 + dv * np.cos(x3) - self._omega * x2 - self._k3 * x2 * x3,
                self._omega * x1 + self._k3 * x1 * x3 - (self._v - dv) * np.sin(x3), domega + self._k3 * x3)
