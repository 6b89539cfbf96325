"""Agents that agree on their outputs: the closed loop of sections 6.2 and 6.3.

    x_i' = A_i x_i + B_i u_i,  y_i = C_i x_i                                                  (6.5)
    u_i  = -K_i sum_{j in N_i} [(y_i - y_j) - (d_i - d_j)] + omega_i                          (6.6)
    x'   = A_cl x - B_cl d + B_d omega,  y = C_cl x                                           (6.7)

On the robots every y in (6.6), the agent's own included, is the value last broadcast (6.11). Then, with y^ held,
x' = A_open x + B_cl y^ - B_cl d + B_d omega, and A_cl = A_open + B_cl C_cl.

Not modelled: nonlinear agents, dynamic controllers, feedthrough from u_i to y_i.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from agents.synchronization.graph import Floats, checked_laplacian, neighbours


@dataclass(frozen=True, eq=False)
class LinearAgent:
    """One agent of (6.5) with its controller gain, as float arrays or lists of rows; ValueError if shapes disagree."""

    A: Floats           # n_x x n_x
    B: Floats           # n_x x n_u
    C: Floats           # n_y x n_x
    K: Floats           # n_u x n_y

    def __post_init__(self) -> None:
        for name in "ABCK":
            object.__setattr__(self, name, _matrix(name, getattr(self, name)))
        n_x, n_u, n_y = self.A.shape[0], self.B.shape[1], self.C.shape[0]
        for name, expected in (("A", (n_x, n_x)), ("B", (n_x, n_u)), ("C", (n_y, n_x)), ("K", (n_u, n_y))):
            shape = getattr(self, name).shape
            if shape != expected:
                raise ValueError(f"{name} is {shape[0]} x {shape[1]}: expected {expected[0]} x {expected[1]} (A, B, C, "
                                 f"K are n_x x n_x, n_x x n_u, n_y x n_x, n_u x n_y in (6.5) and (6.6))")

    @property
    def states(self) -> int:
        return int(self.A.shape[0])

    @property
    def inputs(self) -> int:
        return int(self.B.shape[1])

    @property
    def outputs(self) -> int:
        return int(self.C.shape[0])


def _matrix(name: str, value: ArrayLike) -> Floats:
    matrix = np.array(value, dtype=float)
    if matrix.ndim != 2 or 0 in matrix.shape:
        raise ValueError(f"{name} has shape {matrix.shape}: expected a matrix, a list of rows")
    if not np.all(np.isfinite(matrix)):
        raise ValueError(f"{name} holds {matrix[~np.isfinite(matrix)][0]}: expected finite numbers")
    matrix.setflags(write=False)
    return matrix


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """The matrices of (6.7) for one topology; all agents stacked in the order of their numbers."""

    agents: tuple[LinearAgent, ...]
    laplacian: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "agents", tuple(self.agents))
        object.__setattr__(self, "laplacian", checked_laplacian(self.laplacian))
        if len(self.agents) != len(self.laplacian):
            raise ValueError(f"{len(self.agents)} agents and a Laplacian of {len(self.laplacian)}: one row per agent")
        widths = [agent.outputs for agent in self.agents]
        if len(set(widths)) != 1:
            raise ValueError(f"the agents have {widths} outputs: all need the same number to compare them (6.6)")

    @cached_property
    def A_open(self) -> Floats:
        """diag(A_1, ..., A_N), the agents without coupling."""
        return block_diagonal([agent.A for agent in self.agents])

    @cached_property
    def B_d(self) -> Floats:
        return block_diagonal([agent.B for agent in self.agents])

    @cached_property
    def C_cl(self) -> Floats:
        return block_diagonal([agent.C for agent in self.agents])

    @cached_property
    def B_cl(self) -> Floats:
        """B_cl_ij = -l_ij B_i K_i."""
        BK = block_diagonal([agent.B @ agent.K for agent in self.agents])
        return -BK @ np.kron(self.laplacian, np.eye(self.agents[0].outputs))

    @cached_property
    def A_cl(self) -> Floats:
        """A_i - l_ii B_i K_i C_i on the diagonal, -l_ij B_i K_i C_j elsewhere."""
        return self.A_open + self.B_cl @ self.C_cl

    @property
    def rightmost_eigenvalue(self) -> complex:
        """The eigenvalue of A_cl with the largest real part."""
        values = np.linalg.eigvals(self.A_cl)
        return complex(values[np.argmax(values.real)])

    def equilibrium(self, bias: ArrayLike) -> Floats:
        """x_eq = A_cl^-1 B_cl d for the stacked bias d (6.8); the outputs there are y_eq = C_cl x_eq (6.9)."""
        d = np.asarray(bias, dtype=float).reshape(-1)
        if d.size != self.B_cl.shape[1]:
            raise ValueError(f"the bias has {d.size} entries: expected {self.B_cl.shape[1]}, one per output")
        x_eq: Floats = np.linalg.solve(self.A_cl, self.B_cl @ d)
        return x_eq

    def remark_13_problems(self) -> list[str]:
        """Return where the sufficient conditions (i), (ii) of Remark 13 fail; empty: A_cl is Hurwitz."""
        found = []
        heard = neighbours(self.laplacian)
        for i, agent in enumerate(self.agents):
            BK = agent.B @ agent.K
            own = np.linalg.eigvals(agent.A - self.laplacian[i, i] * BK @ agent.C)
            worst = own[np.argmax(own.real)]
            if worst.real >= 0:
                found.append(f"Remark 13 (i), agent {i}: A_i - l_ii B_i K_i C_i has the eigenvalue {worst:.6g}")
            pull = sum(float(np.linalg.norm(BK @ self.agents[j].C, 2)) for j in heard[i])
            if np.abs(own).min() < pull:
                found.append(f"Remark 13 (ii), agent {i}: min |lambda| = {np.abs(own).min():.6g} is below "
                             f"sum ||B_i K_i C_j|| = {pull:.6g}")
        return found


def block_diagonal(blocks: Sequence[Floats]) -> Floats:
    return np.block([[block if j == i else np.zeros((len(block), other.shape[1])) for j, other in enumerate(blocks)]
                     for i, block in enumerate(blocks)])
