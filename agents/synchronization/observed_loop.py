"""The sampled loop of agents that broadcast observed outputs: exact maps, with and without measurement noise.

State z = ((x_1, xh_1), ..., (x_N, xh_N), y^), the estimates of `observer` beside the states of `exact_loop`. At the
start of its slot an agent corrects its estimate and broadcasts C xh:

    jump   xh_i+ = xh_i + L_i (C_i x_i + nu_i - C_i xh_i),   y^_i+ = C_i xh_i+      for i in P_k

Since eps = xh - x depends on nothing but itself, the spectrum of a round's map M is that of the loop without observers
together with that of the observers (separation): exp(p_k T tau) for every pole, and for every eigenvalue of an A_i that
no output shows. So observers leave the limit of the slot length as it is.

    a round with the noises nu_r of its measurements:    z_(r+1) = M z_r + N nu_r

The condition (4.24), sum_r |e_o(t_r)| <= K |eps(0)|, holds with K = sum_r ||C F^r (I - L C)||, F = (I - L C) exp(A h).

Differs from the dissertation: Remark 6 asks (4.24) of the observer's error e_o = C eps. With |e_o(0)| on the right no K
exists if C has a null space: eps(0) in it gives e_o(0) = 0 and later errors. With the error of the state it holds.
Not modelled: losses, delays of a slot or more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from agents.synchronization.closed_loop import LinearAgent, block_diagonal
from agents.synchronization.exact_loop import ExactLoop, spectral_radius
from agents.synchronization.graph import Floats
from agents.synchronization.matrix_exponential import matrix_exponential
from agents.synchronization.observer import observable_basis, observer_gain
from agents.synchronization.partition import Parts

NEGLIGIBLE = 1e-9          # ||G^R|| from which on the rest of a series is bounded and not added


@dataclass(frozen=True, eq=False)
class ObservedLoop:
    """One topology; `poles` are those of each agent's observer [1/s]."""

    agents: tuple[LinearAgent, ...]
    laplacian: Floats
    parts: Parts
    poles: Sequence[Sequence[float]]

    @cached_property
    def loop(self) -> ExactLoop:
        """The loop without observers, of agents with the state (x_i, xh_i) and the output C_i xh_i."""
        both = [LinearAgent(block_diagonal([agent.A, agent.A]), np.vstack([agent.B, agent.B]),
                            np.hstack([np.zeros(agent.C.shape), agent.C]), agent.K) for agent in self.agents]
        return ExactLoop(tuple(both), self.laplacian, self.parts)

    def start(self, x0: Floats, xh0: Floats) -> Floats:
        """Return z if every agent uses every y(0) until its first broadcast."""
        y0 = block_diagonal([agent.C for agent in self.agents]) @ x0
        ends = np.cumsum([agent.states for agent in self.agents])[:-1]
        pairs = zip(np.split(x0, ends), np.split(xh0, ends), strict=True)
        return np.concatenate([*(np.concatenate(pair) for pair in pairs), y0])

    def states_of(self, z: Floats) -> tuple[Floats, Floats]:
        """Return x and xh, all agents stacked."""
        x = [z[rows] for rows, _ in self._places]
        return np.concatenate(x), np.concatenate([z[rows] for _, rows in self._places])

    def slot_maps(self, slot: int, tau_s: float, delay_s: float = 0.0) -> tuple[Floats, Floats]:
        """Return the map of z over a slot and that of the noises of all agents, of which only its part's act."""
        flow = self.loop.slot_map(slot, tau_s, delay_s)
        corrected, noise = np.eye(len(flow)), np.zeros((len(flow), len(self.agents) * self._width))
        for agent in self.parts[slot]:
            model, (x, xh) = self.agents[agent], self._places[agent]
            L = observer_gain(model, self.poles[agent], len(self.parts) * tau_s)
            corrected[xh, x] = L @ model.C
            corrected[xh, xh] -= L @ model.C
            noise[xh, agent * self._width:(agent + 1) * self._width] = L
        return flow @ corrected, flow @ noise

    def round_maps(self, tau_s: float, delay_s: float = 0.0) -> tuple[Floats, Floats]:
        """Return M and N, the maps of z and of the noises over a round."""
        M = np.eye(sum(agent.states for agent in self.agents) * 2 + len(self.agents) * self._width)
        N = np.zeros((len(M), len(self.agents) * self._width))
        for slot in range(len(self.parts)):
            over, by_noise = self.slot_maps(slot, tau_s, delay_s)
            M, N = over @ M, over @ N + by_noise
        return M, N

    def spectral_radius(self, tau_s: float, delay_s: float = 0.0) -> float:
        return spectral_radius(self.round_maps(tau_s, delay_s)[0])

    @cached_property
    def outputs(self) -> Floats:
        """The matrix from z to the true outputs y = (C_1 x_1, ..., C_N x_N)."""
        C = np.zeros((len(self.agents) * self._width, self._places[-1][1].stop + len(self.agents) * self._width))
        for number, (agent, (x, _)) in enumerate(zip(self.agents, self._places, strict=True)):
            C[number * self._width:(number + 1) * self._width, x] = agent.C
        return C

    @property
    def _width(self) -> int:
        return self.agents[0].outputs

    @cached_property
    def _places(self) -> list[tuple[slice, slice]]:
        """The places of x_i and xh_i in z."""
        places, first = [], 0
        for agent in self.agents:
            middle, end = first + agent.states, first + 2 * agent.states
            places.append((slice(first, middle), slice(middle, end)))
            first = end
        return places


def broadcast_errors(agent: LinearAgent, poles: Sequence[float], h_s: float) -> float:
    """Return K of (4.24) without noise: sum_r |e_o(t_r)| <= K |eps(t_0)|, eps(t_0) just before the first correction."""
    L = observer_gain(agent, poles, h_s)
    return _series(agent, L, h_s, np.eye(agent.states) - L @ agent.C)


def broadcast_noise(agent: LinearAgent, poles: Sequence[float], h_s: float) -> float:
    """Return the largest |e_o| at a broadcast that noises with |nu| <= 1 can cause from eps = 0 on."""
    L = observer_gain(agent, poles, h_s)
    return _series(agent, L, h_s, L)


def _series(agent: LinearAgent, L: Floats, h_s: float, right: Floats) -> float:
    """Return sum_r ||C G^r right||, G = (I - L C) exp(A h), with a bound on the rest in place of the last terms.

    The rest after R terms is at most sum_(r < R) ||C G^r|| ||right|| q / (1 - q), q = ||G^R||."""
    Q = observable_basis(agent)             # e_o depends on these components of eps alone
    C = agent.C @ Q
    G = (np.eye(Q.shape[1]) - Q.T @ L @ C) @ matrix_exponential(Q.T @ agent.A @ Q * h_s)
    power, total, left, right = np.eye(len(G)), 0.0, 0.0, Q.T @ right
    while (q := float(np.linalg.norm(power, 2))) > NEGLIGIBLE:
        total += float(np.linalg.norm(C @ power @ right, 2))
        left += float(np.linalg.norm(C @ power, 2))
        power = G @ power
    return total + left * float(np.linalg.norm(right, 2)) * q / (1 - q)
