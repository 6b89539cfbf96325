"""A whole run of the sampled loop, exact at integer nanoseconds: the reference for emulated runs.

Slots follow each other from t = 0; slot k of a round belongs to part P_(k+1), which broadcasts at the slot's start.
At a round's end, the instant at which the next round's first slot starts, the team adopts the topology requested then;
that slot already has its partition and slot length. Between these instants every agent's input (6.11) is constant, so

    x(t + h) = exp(A h) x(t) + integral of exp(A s) ds B u         (exact for any h)

At the start every agent knows every y(0). Not modelled: losses; delays of a slot or more; clocks that differ.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from agents.synchronization.closed_loop import LinearAgent, block_diagonal
from agents.synchronization.exact_loop import Hearing, links_with_a_value
from agents.synchronization.graph import Floats
from agents.synchronization.round_plan import RoundPlan


@dataclass(frozen=True, eq=False)
class ExactRun:
    outputs: Floats                             # one row per sample instant, one column per output
    states: Floats                              # one row per sample instant
    adoptions: tuple[tuple[int, int], ...]      # (instant in ns, number of the plan), the first at 0
    broadcasts: tuple[tuple[int, int], ...]     # (instant in ns, agent)


def alternating(period_ns: int, plans: int = 2) -> Callable[[int], int]:
    """Return the signal that requests plan 0 over [0, period_ns), then plan 1, ..., and cyclically again."""
    return lambda t_ns: t_ns // period_ns % plans


def simulate(agents: Sequence[LinearAgent], plans: Sequence[RoundPlan], requested: Callable[[int], int], length_ns: int,
             sample_ns: Sequence[int], *, x0: ArrayLike | None = None, bias: ArrayLike | None = None,
             disturbance: Sequence[tuple[int, ArrayLike]] = (), delay_ns: int = 0,
             hearing: Hearing = Hearing.EVERYONE) -> ExactRun:
    """Run over [0, length_ns]; x0 is all ones and bias d zero unless given.

    `requested(t_ns)` returns the number of the plan requested at t. `disturbance` holds (from_ns, omega), ascending;
    omega, one number or one per input, holds until the next. Raises ValueError for bad delays or sample instants.
    """
    if any(not 0 <= delay_ns < plan.slot_ns for plan in plans):
        raise ValueError(f"delay_ns={delay_ns}: expected 0 <= delay < slot_ns of {[plan.slot_ns for plan in plans]}")
    ascending = all(earlier <= later for earlier, later in pairwise(sample_ns))
    if not ascending or not all(0 <= t_ns <= length_ns for t_ns in sample_ns):
        raise ValueError(f"sample_ns: expected ascending instants from 0 to {length_ns}")
    team = _Team(agents, x0, bias, disturbance, sample_ns)
    adoptions: list[tuple[int, int]] = []
    broadcasts: list[tuple[int, int]] = []
    now_ns = 0
    while now_ns < length_ns:
        wanted = requested(now_ns)
        plan = plans[wanted]
        previous = plans[adoptions[-1][1]].laplacian if adoptions else plan.laplacian
        if not adoptions or adoptions[-1][1] != wanted:
            adoptions.append((now_ns, wanted))
        spoken: list[int] = []
        for part in plan.parts:
            if now_ns == length_ns:
                break
            end_ns = min(now_ns + plan.slot_ns, length_ns)
            broadcasts += [(now_ns, agent) for agent in part]
            values = team.outputs()
            team.advance(min(now_ns + delay_ns, end_ns), _acting(plan, previous, spoken, hearing))
            team.take(part, values)
            spoken += part
            team.advance(end_ns, _acting(plan, previous, spoken, hearing))
            now_ns = end_ns
    return ExactRun(*team.sampled(), tuple(adoptions), tuple(broadcasts))


def _acting(plan: RoundPlan, previous: Floats, spoken: Sequence[int], hearing: Hearing) -> Floats:
    if hearing is Hearing.EVERYONE or np.array_equal(plan.laplacian, previous):
        return plan.laplacian
    return links_with_a_value(plan.laplacian, previous, spoken)


class _Team:
    """States of all agents, their held outputs, and the samples taken so far."""

    def __init__(self, agents: Sequence[LinearAgent], x0: ArrayLike | None, bias: ArrayLike | None,
                 disturbance: Sequence[tuple[int, ArrayLike]], sample_ns: Sequence[int]) -> None:
        self._A = block_diagonal([agent.A for agent in agents])
        self._B = block_diagonal([agent.B for agent in agents])
        self._C = block_diagonal([agent.C for agent in agents])
        self._K = block_diagonal([agent.K for agent in agents])
        self._width = agents[0].outputs
        self._bias = np.zeros(len(self._C)) if bias is None else np.asarray(bias, dtype=float).reshape(-1)
        self._disturbance = [(from_ns, np.broadcast_to(omega, self._B.shape[1])) for from_ns, omega in disturbance]
        self._to_sample = deque(sample_ns)
        self._samples: list[Floats] = []
        self._steps: dict[int, tuple[Floats, Floats]] = {}
        self._x = np.ones(len(self._A)) if x0 is None else np.array(x0, dtype=float).reshape(-1)
        self._held = self.outputs()
        self._now_ns = 0

    def outputs(self) -> Floats:
        return self._C @ self._x

    def take(self, part: Sequence[int], values: Floats) -> None:
        """Hold the values that the agents of `part` broadcast; `values` are those of all agents at that instant."""
        for agent in part:
            rows = slice(agent * self._width, (agent + 1) * self._width)
            self._held[rows] = values[rows]

    def advance(self, until_ns: int, acting: Floats) -> None:
        """Advance the states with held outputs and the links of `acting`, sampling at instants in [now, until_ns)."""
        agreement = -self._K @ np.kron(acting, np.eye(self._width)) @ (self._held - self._bias)
        changes = [from_ns for from_ns, _ in self._disturbance if self._now_ns < from_ns < until_ns]
        for piece_end_ns in (*changes, until_ns):
            omega = next((value for from_ns, value in reversed(self._disturbance) if from_ns <= self._now_ns), 0.0)
            u = agreement + omega
            while self._to_sample and self._to_sample[0] < piece_end_ns:
                self._samples.append(self._stepped(self._to_sample.popleft() - self._now_ns, u))
            self._x = self._stepped(piece_end_ns - self._now_ns, u)
            self._now_ns = piece_end_ns

    def sampled(self) -> tuple[Floats, Floats]:
        """Return (outputs, states) at the sample instants; the last one may be the end of the run."""
        states = np.array(self._samples + [self._x] * len(self._to_sample)).reshape(-1, len(self._x))
        return states @ self._C.T, states

    def _stepped(self, h_ns: int, u: Floats) -> Floats:
        if h_ns == 0:
            return self._x.copy()
        if h_ns not in self._steps:
            self._steps[h_ns] = _held_input_step(self._A, self._B, h_ns * 1e-9)
        Phi, Gamma = self._steps[h_ns]
        x: Floats = Phi @ self._x + Gamma @ u
        return x


def _held_input_step(A: Floats, B: Floats, h_s: float) -> tuple[Floats, Floats]:
    """Return exp(A h) and the integral of exp(A s) B over [0, h], from one exponential (Van Loan 1978)."""
    from scipy.linalg import expm  # here, so that importing this file does not load SciPy

    states, inputs = B.shape
    grown = expm(np.block([[A, B], [np.zeros((inputs, states + inputs))]]) * h_s)
    return grown[:states, :states], grown[:states, states:]
