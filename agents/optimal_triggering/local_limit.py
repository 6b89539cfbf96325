"""The exact local limit of an interval: the largest tau at which looks every tau seconds are stable near x = 0.

Without noise the state at a look is mapped to that at the next by x -> flow(x, u(x), omega^_p, tau). Its linear part at
0 has a spectral radius that reaches 1 at the limit; beyond it no small error decays. Unlike the certificates of
Chapter 4 this says nothing about large errors.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from agents.optimal_triggering.held_loop import Floats, HeldLoop, flow

STEP = 1e-6                 # of the central differences
SCAN_S, LONGEST_S = 0.02, 20.0


def transition(loop: HeldLoop, tau_s: float) -> Floats:
    """Return the Jacobian at x = 0 of the map from one look to the next."""
    x = np.concatenate([np.eye(3), -np.eye(3)], axis=1) * STEP
    after = flow(x, loop.command(x), loop.inputs(), tau_s)
    jacobian: Floats = (after[:, :3] - after[:, 3:]) / (2 * STEP)
    return jacobian


def spectral_radius(loop: HeldLoop, tau_s: float) -> float:
    return float(np.abs(np.linalg.eigvals(transition(loop, tau_s))).max())


def local_limit_s(loop: HeldLoop) -> float:
    """Return the first tau at which the spectral radius reaches 1; ValueError if the loop is unstable for small tau."""
    if spectral_radius(loop, SCAN_S) >= 1:
        raise ValueError(f"omega^_p={tuple(loop.held)}: looks every {SCAN_S} s do not stabilize x = 0: the reference "
                         "has to move")
    tau_s = SCAN_S
    while tau_s < LONGEST_S:
        if spectral_radius(loop, tau_s + SCAN_S) >= 1:
            return float(brentq(lambda tau: spectral_radius(loop, tau) - 1, tau_s, tau_s + SCAN_S))
        tau_s += SCAN_S
    return LONGEST_S
