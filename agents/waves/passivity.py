"""Whether a linear agent G(s) = C (sI - A)^-1 B is passive from u to y, by the wave that it reflects.

An agent with F = -u = b e - sqrt(2 b) w and e = y answers an incoming wave w with v = S w,

    S(s) = (b G(s) - 1) / (b G(s) + 1):     A - b B C,  sqrt(2 b) B,  sqrt(2 b) C,  -1.

It is passive if and only if S has no pole with Re s >= 0 and |S(j omega)| <= 1 for all omega, for any b > 0: it returns
no more wave energy than it gets. This is G positive real, Re G(j omega) >= 0, without its poles on the axis
(Anderson and Vongpanitlerd 1973, Network Analysis and Synthesis, section 2.7). The norm of S is that of `gains.py`, so
a violation of less than its relative accuracy of 1e-8 counts as none. The agent is controllable and observable.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from agents.synchronization.gains import RELATIVE_ACCURACY, h_infinity_norm
from agents.waves.agent import Agent


def violation(agent: Agent, impedance: float) -> str | None:
    """Return the violated inequality of an agent that is not passive, with its number; None for a passive one."""
    A = agent.A - impedance * agent.B @ agent.C
    poles = np.linalg.eigvals(A)
    worst = poles[np.argmax(poles.real)]
    if worst.real >= 0:
        return (f"Re lambda(A - b B C) = {worst.real:.6g}, expected below 0 (b = {impedance:g}): a damper does not "
                "bring the agent to rest")
    norm = h_infinity_norm(A, sqrt(2 * impedance) * agent.B, sqrt(2 * impedance) * agent.C, np.array([[-1.0]]))
    if norm.lower <= 1 + RELATIVE_ACCURACY:
        return None
    omega = norm.peak_rad_s
    response = agent.C @ np.linalg.solve(1j * omega * np.eye(agent.states) - agent.A, agent.B)
    return (f"Re G(j omega) = {response[0, 0].real:.6g} at omega = {omega:.6g} rad/s, expected 0 or more; it reflects "
            f"{norm.lower:.6g} times the wave that it gets, expected at most 1 (b = {impedance:g})")
