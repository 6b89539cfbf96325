"""A linear loop that flows, and jumps at instants that repeat every period: the exact map of a period.

    z' = A z between jumps          z+ = J z at a jump          M = map of z over one period, from just before time 0

If `agreement` is an eigenvector of M with the eigenvalue 1, the loop may end anywhere on it; `radius` is then the
spectral radius of M without that eigenvalue. The loop converges exponentially if and only if the radius is below 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from agents.synchronization.graph import Floats
from agents.synchronization.matrix_exponential import matrix_exponential

SAME = 1e-9         # relative error up to which M a is a


@dataclass(frozen=True, eq=False)
class Jump:
    at_ns: int              # in [0, period)
    matrix: Floats


@dataclass(frozen=True, eq=False)
class JumpLoop:
    """`jumps` in the order in which they act, ascending in time."""

    generator: Floats           # A
    period_ns: int
    jumps: tuple[Jump, ...]
    agreement: Floats | None = None

    @cached_property
    def period_map(self) -> Floats:
        M, now_ns = np.eye(len(self.generator)), 0
        for jump in self.jumps:
            M = jump.matrix @ self._flow(jump.at_ns - now_ns) @ M
            now_ns = jump.at_ns
        whole: Floats = self._flow(self.period_ns - now_ns) @ M
        return whole

    @cached_property
    def agrees(self) -> bool:
        """Whether `agreement` is an eigenvector of M with the eigenvalue 1."""
        a = self.agreement
        return a is not None and bool(np.abs(self.period_map @ a - a).max() <= SAME * np.abs(a).max())

    @cached_property
    def radius(self) -> float:
        values = np.linalg.eigvals(self.period_map)
        if self.agrees:
            values = np.delete(values, np.argmin(np.abs(values - 1)))
        return float(np.abs(values).max())

    def limit(self, z: Floats) -> float:
        """Return how many times `agreement` the loop comes to from z, the state just before time 0."""
        assert self.agreement is not None
        left = np.linalg.svd((self.period_map - np.eye(len(z))).T)[2][-1]      # left M = left
        return float(left @ z / (left @ self.agreement))

    def states_at(self, z: Floats, instants_ns: Sequence[int]) -> Floats:
        """Return the states at ascending instants from z, the state just before time 0; after the jumps of an instant.

        One row for each instant."""
        found, now_ns, k = [], 0, 0
        for instant_ns in instants_ns:
            while (due_ns := self._due_ns(k)) is not None and due_ns <= instant_ns:
                z = self.jumps[k % len(self.jumps)].matrix @ (self._flow(due_ns - now_ns) @ z)
                now_ns, k = due_ns, k + 1
            found.append(self._flow(instant_ns - now_ns) @ z)
        return np.array(found)

    def _due_ns(self, k: int) -> int | None:
        """Return the instant of the k-th jump of all; None if there are none."""
        if not self.jumps:
            return None
        return k // len(self.jumps) * self.period_ns + self.jumps[k % len(self.jumps)].at_ns

    def _flow(self, h_ns: int) -> Floats:
        flows = self._flows
        if h_ns not in flows:
            flows[h_ns] = matrix_exponential(self.generator * (h_ns * 1e-9)) if h_ns else np.eye(len(self.generator))
        return flows[h_ns]

    @cached_property
    def _flows(self) -> dict[int, Floats]:
        return {}
