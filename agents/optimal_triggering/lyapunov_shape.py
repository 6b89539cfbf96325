"""P of the reference function a(x) = x'Px: the cost from x on with continuous looks, to second order at x = 0.

    A'P + PA + Q + K'RK = 0,     A, K the linear parts at 0 of the closed loop and of the controller
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_continuous_lyapunov

from agents.optimal_triggering.held_loop import Floats, HeldLoop
from agents.optimal_triggering.local_limit import STEP, transition

SHORT_S = 1e-4          # looks this far apart stand for continuous ones


def lyapunov_shape(loop: HeldLoop) -> Floats:
    A = (transition(loop, SHORT_S) - np.eye(3)) / SHORT_S
    K = (loop.command(STEP * np.eye(3)) - loop.command(-STEP * np.eye(3))) / (2 * STEP)
    rate = loop.weights.q * np.eye(3) + loop.weights.r * K.T @ K
    return np.asarray(solve_continuous_lyapunov(A.T, -rate), np.float64)
