"""Gain of the error system over a finite horizon, and the horizon that the small-gain condition certifies.

Between measurements |e'| <= A |e| + y~ (4.25). With a = ||A||, or any a with ||exp(A t)|| <= exp(a t), Theorem 3 gives

    ||e[0, tau]||_p <= K_e(tau) ||e(0)|| + gamma_e(tau) ||y~[0, tau]||_p                                  (4.26)
    K_e(tau) = ((exp(a p tau) - 1) / (p a))^(1/p),     gamma_e(tau) = (exp(a tau) - 1) / a         (4.27), (4.28)

and gamma_n gamma_e(tau) <= kappa < 1 holds up to tau* = ln(kappa a / gamma_n + 1) / a                       (4.37).

Differs from the dissertation:
- (4.26) is an inequality;
- for p = infinity K_e is exp(a tau), the limit of (4.27); below (A.11) it is printed with a "- 1", so 0 for tau = 0;
- a depends on the reachable set over [0, tau], so on tau: `largest_horizon` finds both together.
Not modelled: delay between a measurement and the command that follows from it (Remark 7).
"""

from __future__ import annotations

from collections.abc import Callable
from math import exp, inf
from math import expm1 as library_expm1
from typing import NamedTuple

from firmware_sim.shared_functions import expm1, log1p

KAPPA = 0.999           # section 4.5
SETTLED = 1e-5          # accuracy of `largest_horizon`, as a share of kappa / gamma_n
LARGEST_EXPONENT = 700.0
TINY_PER_S = 1e-9       # growth below which gamma_e(tau) = tau to 1e-9 for every horizon below 1 s


def initial_error_gain(growth_per_s: float, tau_s: float, p: float = 2.0) -> float:
    """Return K_e(tau) of (4.27); raises ValueError unless p is in [1, inf]."""
    if not p >= 1:
        raise ValueError(f"p={p}: L_p norms need p >= 1")
    if growth_per_s * tau_s > LARGEST_EXPONENT:
        return inf
    if p == inf:
        return exp(growth_per_s * tau_s)
    shrunk = tau_s if growth_per_s <= TINY_PER_S else -library_expm1(-growth_per_s * p * tau_s) / (p * growth_per_s)
    return float(exp(growth_per_s * tau_s) * shrunk ** (1 / p))


def error_gain(growth_per_s: float, tau_s: float) -> float:
    """Return gamma_e(tau) of (4.28) [s]; inf where it exceeds the range of floats."""
    if growth_per_s * tau_s > LARGEST_EXPONENT:
        return inf
    return tau_s if growth_per_s <= TINY_PER_S else expm1(growth_per_s * tau_s) / growth_per_s


def horizon_s(growth_per_s: float, gain_per_s: float, kappa: float = KAPPA) -> float:
    """Return tau* [s] of (4.36), (4.37): gain gamma_e(tau*) = kappa; with the suprema V, Z Remark 4's lower bound."""
    if growth_per_s == inf:
        return 0.0
    if growth_per_s <= TINY_PER_S:
        return kappa / gain_per_s
    return log1p(kappa * growth_per_s / gain_per_s) / growth_per_s


def longest_horizon_s(gain_per_s: float, kappa: float = KAPPA) -> float:
    """Return kappa / gamma_n [s], an upper bound of every horizon (Remark 5, with the smallest gain Z_l)."""
    return kappa / gain_per_s


class Horizon(NamedTuple):
    tau_s: float
    growth_per_s: float     # a bound that holds over [0, tau_s]


def largest_horizon(growth_until: Callable[[float], float], gain_per_s: float, kappa: float = KAPPA) -> Horizon:
    """Return the largest tau with tau <= tau*(a(tau)), a = `growth_until`: from below, to SETTLED kappa / gain.

    a does not decrease, so tau*(a(tau)) does not increase and crosses tau once. For a tau that is too long,
    tau*(a(tau)) is safe, since the a of a long interval holds over a short one; for a safe tau it is too long. Both
    mostly converge to the crossing in a few steps; if not, the interval is bisected.
    """
    high = kappa / gain_per_s
    settled = SETTLED * high
    low = horizon_s(growth_until(high), gain_per_s, kappa)
    while True:
        assert 0 <= low <= high, f"the growth over {high} s is no number"
        width = high - low
        growth = growth_until(low)
        high = min(high, horizon_s(growth, gain_per_s, kappa))
        if high - low <= settled:
            return Horizon(low, growth)
        tried = high if 2 * (high - low) < width else (low + high) / 2
        allowed = horizon_s(growth_until(tried), gain_per_s, kappa)
        if allowed < tried:
            high = tried
        low = max(low, min(tried, allowed))
