"""The tracking loop between two looks: R1 holds its command, R2 its inputs; flow in closed form, cost by quadrature.

    p(t) = Rot(-omega1 t) [ p(0) + c(v2, omega2; x3) - c(v1, omega1; 0) ],     x3(t) = x3(0) + (omega2 - omega1) t
    c(v, omega; h) = v t sinc(omega t / 2) (cos, sin)(h + omega t / 2)         chord of an arc, sinc(a) = sin(a) / a
    cost = integral over [0, tau] of x'Qx dt + u'Ru tau                        Gauss-Legendre

Arrays: a state has shape (3, ...), a command and inputs (2, ...), and all broadcast. The largest turn of x within
tau is |omega1| tau; six nodes integrate turns of up to 2 rad to 1e-9 of the cost.

Not modelled: limits of the command, wheels, inputs that change between two looks (the caller splits the interval).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import NDArray

from agents.tracking.controller import Inputs, TrackingController

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Weights:
    """Q = q I3 and R = r I2 of (5.5); in W/m^2 and W/(m/s)^2 if the cost is an energy."""

    q: float = 0.1
    r: float = 0.1

    def __post_init__(self) -> None:
        if not (self.q > 0 and self.r > 0):
            raise ValueError(f"q={self.q}, r={self.r}: expected more than 0, Q and R of (5.5) are positive definite")


@dataclass(frozen=True)
class HeldLoop:
    held: Inputs                                    # omega^_p
    weights: Weights = Weights()
    controller: TrackingController = field(default_factory=TrackingController)
    nodes: int = 6                                  # of the quadrature

    def command(self, measured: Floats) -> Floats:
        """Return u of (5.18) for measured states; a heading error is not wrapped."""
        x1, x2, x3 = measured
        v, omega = self.held
        c = self.controller
        return np.stack([v * np.cos(x3) + c.k1_per_s * x1,
                         omega + c.k2_per_m2 * v * np.sinc(x3 / np.pi) * x2 + c.k3_per_s * x3])

    def inputs(self, error: Floats | None = None) -> Floats:
        """Return omega_p = omega^_p - e_omega."""
        held = np.array(self.held)
        return held if error is None else held.reshape(2, *[1] * (error.ndim - 1)) - error

    def cost(self, x: Floats, u: Floats, inputs: Floats, tau_s: Floats | float) -> Floats:
        """Return the integral of x'Qx + u'Ru over [0, tau]."""
        squares = sum(share * (flow(x, u, inputs, tau_s * place) ** 2).sum(axis=0)
                      for place, share in _legendre(self.nodes))
        total: Floats = (self.weights.q * squares + self.weights.r * (u ** 2).sum(axis=0)) * tau_s
        return total


@cache
def _legendre(nodes: int) -> list[tuple[float, float]]:
    """Return places and weights of the Gauss-Legendre formula on [0, 1]."""
    places, shares = np.polynomial.legendre.leggauss(nodes)
    return [((1 + place) / 2, share / 2) for place, share in zip(places.tolist(), shares.tolist(), strict=True)]


def flow(x: Floats, u: Floats, inputs: Floats, t_s: Floats | float) -> Floats:
    """Return the state after t_s of constant velocities u of R1 and `inputs` of R2, exactly."""
    x1, x2, x3 = x
    (v1, omega1), (v2, omega2) = u, inputs
    half1, half2 = omega1 * t_s / 2, omega2 * t_s / 2
    own, other = v1 * t_s * np.sinc(half1 / np.pi), v2 * t_s * np.sinc(half2 / np.pi)
    ahead = x1 + other * np.cos(x3 + half2) - own * np.cos(half1)
    left = x2 + other * np.sin(x3 + half2) - own * np.sin(half1)
    cosine, sine = np.cos(2 * half1), np.sin(2 * half1)
    return np.stack(np.broadcast_arrays(cosine * ahead + sine * left, cosine * left - sine * ahead,
                                        x3 + 2 * (half2 - half1)))
