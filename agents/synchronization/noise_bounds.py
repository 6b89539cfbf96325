"""Bounds the outputs of a team whose robots measure with noise, in L2 and in their greatest value.

With noise a broadcast sets e_i to the error n_i of the broadcast value: e_i+ = n_i, |n_i| <= b_i; without observers n_i
is the noise, with them e_o,i. The loop is then L2-stable with bias (Definition 10). Printed, with (6.20) and (4.41):

    ||y~|| <= gamma / (1 - gamma gamma_e) b sqrt(t) + ...,    b = |b| exp(||A*|| T tau)

Ours: let n(t) hold, for each component, the error of its last broadcast. e - n is 0 after every reset, at most h =
T tau apart, and has the rate of e. By Wirtinger's inequality ||e - n|| <= (2 h / pi) ||e'||, and by (6.13), (6.14)

    ||e'|| <= k2 + g ||e||,  ||y|| <= k1 + gamma_y ||e||
    =>  ||y|| <= k1 + gamma_y (||n|| + (2 h / pi) k2) / (1 - kappa)

with kappa = 2 h g / pi < 1, g the gain from e to C_cl (A_cl x + B_cl e), gamma_y that from e to y, and k1, k2 the norms
of the responses of y and y' to x(0). ||n|| over [0, t] is at most |b| sqrt(t).

Exact, from the maps of a round z+ = M z + N nu (`observed_loop`), at the starts of rounds: the largest |y_i| under
noises with |nu| <= 1, sum_r ||C M^r N||_1, and the variance under independent noises, C P C', P = M P M' + N N'.

Differs from the dissertation: it bounds e with exp(||A|| tau) and the gain of a feedback whose product of gains is
kappa = 0.999, so that the noise is amplified by 1 / (1 - 0.999).
Not modelled: disturbances; the bound between two starts of rounds is that in L2 alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import exp, pi, sqrt

import numpy as np

from agents.synchronization.closed_loop import ClosedLoop
from agents.synchronization.common_lyapunov import discrete_lyapunov
from agents.synchronization.gains import a_star, h_infinity_norm, l2_gain
from agents.synchronization.graph import Floats
from agents.synchronization.slot_length import error_gain


@dataclass(frozen=True, eq=False)
class BiasBound:
    """The L2 bound with bias for slots of `tau_s`, `parts` a round; ValueError if kappa is not below 1."""

    loop: ClosedLoop
    parts: int
    tau_s: float

    def __post_init__(self) -> None:
        if not self.kappa < 1:
            raise ValueError(f"tau_s={self.tau_s}: kappa = 2 T tau g / pi is {self.kappa:.6g}, expected below 1; "
                             "shorten the slots")

    @cached_property
    def kappa(self) -> float:
        loop = self.loop
        g = h_infinity_norm(loop.A_cl, loop.B_cl, loop.C_cl @ loop.A_cl, loop.C_cl @ loop.B_cl).upper
        return self._share_s * g

    @cached_property
    def gain(self) -> float:
        """The gain from n to y: rms(y) <= gain rms(n) for large t."""
        loop = self.loop
        nothing = np.zeros((len(loop.C_cl), loop.B_cl.shape[1]))
        return h_infinity_norm(loop.A_cl, loop.B_cl, loop.C_cl, nothing).upper / (1 - self.kappa)

    def of_outputs(self, x0: Floats, largest_error: float, t_s: float) -> float:
        """Return the bound of ||y|| over [0, t] if |n| <= `largest_error`, x(0) = x0 and e(0) = 0."""
        loop = self.loop
        k1 = _response(loop.A_cl, loop.C_cl, x0)
        k2 = _response(loop.A_cl, loop.C_cl @ loop.A_cl, x0)
        return k1 + self.gain * (largest_error * sqrt(t_s) + self._share_s * k2)

    @property
    def printed_gain(self) -> float:
        """gamma / (1 - gamma gamma_e) exp(||A*|| T tau), from the noise to y~; inf if (6.20) does not certify tau."""
        gamma, norm = l2_gain(self.loop).upper, float(np.linalg.norm(a_star(self.loop), 2))
        product = gamma * error_gain(norm, self.parts, self.tau_s)
        return gamma / (1 - product) * exp(norm * self.parts * self.tau_s) if product < 1 else float("inf")

    @property
    def _share_s(self) -> float:
        return 2 * self.parts * self.tau_s / pi


def largest_outputs(M: Floats, N: Floats, C: Floats) -> Floats:
    """Return sum_r |C M^r N| summed over the noises: the largest |y_i| that |nu| <= 1 can cause, for each output.

    Rounds are added until a round's share is below 1e-12 of the sum."""
    total, row = np.zeros(len(C)), C.copy()
    while True:
        added = np.abs(row @ N).sum(axis=1)
        total += added
        row = row @ M
        if added.max() <= 1e-12 * total.max() and np.abs(row @ N).sum(axis=1).max() <= 1e-12 * total.max():
            return total


def standard_deviations(M: Floats, N: Floats, C: Floats) -> Floats:
    """Return the standard deviation of each output under independent noises of variance 1, after many rounds."""
    P = discrete_lyapunov(M.T, N @ N.T)
    deviations: Floats = np.sqrt(np.diag(C @ P @ C.T))
    return deviations


def _response(A: Floats, C: Floats, x0: Floats) -> float:
    """Return the L2 norm of C exp(A t) x0 over [0, infinity): sqrt(x0' W x0), A' W + W A = -C' C."""
    n = len(A)
    one = np.eye(n)
    W = np.linalg.solve(np.kron(A.T, one) + np.kron(one, A.T), -(C.T @ C).reshape(-1)).reshape(n, n)
    return float(np.sqrt(x0 @ W @ x0))
