"""The slot length: the largest tau that the small-gain condition gamma gamma_e(tau) < 1 certifies (Theorem 9).

T parts broadcast in turn, one every tau seconds: every component of e is reset once in any interval of length T tau.

PRINTED, (6.20) with a = ||A*||:     gamma_e = T exp(a (T-1) tau) (exp(a tau) - 1) / (a (2 - exp(a T tau)))
LOGARITHMIC_NORM, any L_p, with M = |C_cl B_cl| entrywise and mu = lambda_max((M + M')/2) <= ||M|| <= ||A*||:

    gamma_e = T exp(mu (T-1) tau) (exp(mu tau) - 1) / (mu (1 - lambda)),  lambda = ||M|| (exp(mu T tau) - 1) / mu

WIRTINGER, L2 only: between resets h = T tau apart, ||e|| <= (2 h / pi) ||e'|| (Wirtinger's inequality for a function
that starts at 0; for sampled loops Mirkin 2007), so tau = pi / (2 T g), g the L2-gain from e to C_cl (A_cl x + B_cl e).

Differs from the dissertation:
- for at most N^D successive losses tau is divided by N^D + 1, not N^D (Remark 16), since successes are up to N^D + 1
  rounds apart;
- tau1 is not rounded up to 1.1e-3 s; slots are kappa times the solution, as whole nanoseconds rounded down (Remark 15);
- LOGARITHMIC_NORM is a bound besides the printed one. ||exp(A t)|| <= exp(||A|| t) needs no symmetry, so M need not be
  made symmetric. mu bounds the two exponentials of the numerator, but 2 - exp(||A|| T tau) is a lower bound of
  1 - ||exp(A T tau) - I||, which mu alone does not give (M = [0 1; 0 0] is a counterexample): hence lambda.
Not modelled: airtime and transmission delay (see `exact_loop`), clock error between the agents.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from math import exp, expm1, floor, inf, log, pi

import numpy as np

from agents.synchronization.closed_loop import ClosedLoop
from agents.synchronization.gains import a_star, error_growth, h_infinity_norm, l2_gain
from agents.synchronization.graph import Floats

KAPPA = 0.999       # Remark 15


class Bound(Enum):
    PRINTED = "printed"
    LOGARITHMIC_NORM = "logarithmic norm"
    WIRTINGER = "wirtinger"


def tau_star_s(norm: float, parts: int) -> float:
    """Return tau* = ln 2 / (||A*|| T) [s] of Theorem 8, below which (6.20) is a gain."""
    return log(2) / (norm * parts) if norm > 0 else inf


def error_gain(norm: float, parts: int, tau_s: float) -> float:
    """Return gamma_e of (6.20) with norm = ||A*||; inf from tau* on."""
    if tau_s >= tau_star_s(norm, parts):
        return inf
    numerator = parts * exp(norm * (parts - 1) * tau_s) * _grown(norm, tau_s)
    return numerator / (2 - exp(norm * parts * tau_s))


def error_gain_by_logarithmic_norm(growth: Floats, parts: int, tau_s: float) -> float:
    """Return gamma_e with M = `growth`, a nonnegative matrix; inf if lambda >= 1, where there is no bound."""
    mu = float(np.linalg.eigvalsh((growth + growth.T) / 2)[-1])
    contraction = float(np.linalg.norm(growth, 2)) * _grown(mu, parts * tau_s)
    if contraction >= 1:
        return inf
    return parts * exp(mu * (parts - 1) * tau_s) * _grown(mu, tau_s) / (1 - contraction)


def _grown(rate: float, t_s: float) -> float:
    """Return the integral of exp(rate s) over [0, t_s]."""
    return expm1(rate * t_s) / rate if rate > 0 else t_s


def largest_tau_s(gamma: float, gamma_e: Callable[[float], float], parts: int) -> float:
    """Solve gamma gamma_e(tau) = 1 (Remark 15) for an increasing gamma_e >= T tau, from below to the last bit.

    Raises ValueError unless gamma > 0."""
    if not gamma > 0:
        raise ValueError(f"gamma={gamma}: expected a positive gain; the outputs do not depend on the held values")
    low, high = 0.0, 1 / (gamma * parts)
    while low < (middle := (low + high) / 2) < high:
        if gamma * gamma_e(middle) < 1:
            low = middle
        else:
            high = middle
    return low


def small_gain_tau_s(loop: ClosedLoop, parts: int, bound: Bound = Bound.PRINTED) -> float:
    """Return the solution tau' of Remark 15 [s], before kappa and losses, with the gain that the chosen bound needs."""
    if bound is Bound.WIRTINGER:
        g = h_infinity_norm(loop.A_cl, loop.B_cl, loop.C_cl @ loop.A_cl, loop.C_cl @ loop.B_cl).upper
        return largest_tau_s(g, lambda tau_s: parts * tau_s, parts) * pi / 2
    gamma = l2_gain(loop).upper
    if bound is Bound.LOGARITHMIC_NORM:
        growth = error_growth(loop)
        return largest_tau_s(gamma, lambda tau_s: error_gain_by_logarithmic_norm(growth, parts, tau_s), parts)
    norm = float(np.linalg.norm(a_star(loop), 2))
    return largest_tau_s(gamma, lambda tau_s: error_gain(norm, parts, tau_s), parts)


@dataclass(frozen=True)
class SlotLength:
    """The slot length kappa tau' / (N^D + 1), rounded down to whole nanoseconds; ValueError for less than 1 ns."""

    tau_s: float                        # tau' with gamma gamma_e(tau') = 1
    parts: int                          # T
    kappa: float = KAPPA
    max_successive_losses: int = 0      # N^D

    def __post_init__(self) -> None:
        if not 0 < self.kappa < 1:
            raise ValueError(f"kappa={self.kappa}: expected 0 < kappa < 1, the product of gains must stay below 1")
        if self.max_successive_losses < 0:
            raise ValueError(f"max_successive_losses={self.max_successive_losses}: expected 0 or more")
        if self.parts < 1:
            raise ValueError(f"parts={self.parts}: at least one part broadcasts")
        if self.slot_ns < 1:
            raise ValueError(f"tau_s={self.tau_s}: slots would be shorter than 1 ns; the gains are too large")

    @property
    def slot_ns(self) -> int:
        return floor(self.kappa * self.tau_s / (self.max_successive_losses + 1) * 1e9)
