"""A linear agent with one input and one output, x' = A x + B u, y = C x, as the wave ports see it.

The plant of a robot has its ports' dampers in it, which act at every instant, not at those of frames: a drive with
A - B kappa C in place of A, kappa the sum of the ports' own dampings. `without_damping` takes them out again.
The plant has a second output, the integral of y, as an encoder or an integrating converter measures it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from agents.synchronization.graph import Floats


@dataclass(frozen=True, eq=False)
class Agent:
    A: Floats           # n x n
    B: Floats           # n x 1
    C: Floats           # 1 x n

    @property
    def states(self) -> int:
        return len(self.A)

    def without_damping(self, damping: float) -> Agent:
        """Return the agent behind ports whose own dampings add up to `damping`."""
        return Agent(self.A + damping * self.B @ self.C, self.B, self.C)

    def with_damping(self, damping: float) -> Agent:
        return self.without_damping(-damping)

    def at_rest(self) -> Floats | None:
        """Return the state with the output 1 in which it stays without input; None if there is none."""
        equations = np.vstack([self.A, self.C])
        wanted = np.append(np.zeros(self.states), 1.0)
        x: Floats = np.linalg.lstsq(equations, wanted)[0]
        return x if np.allclose(equations @ x, wanted, rtol=0, atol=1e-9) else None


def read_agent(A: ArrayLike, B: ArrayLike, C: ArrayLike) -> tuple[Agent, int | None]:
    """Return the agent, and the number of the plant's state that is the integral of y; None without a second output.

    Raises ValueError unless the shapes fit and the second output is such a state, which affects no other."""
    matrices = [np.array(matrix, dtype=float) for matrix in (A, B, C)]
    for name, matrix in zip("ABC", matrices, strict=True):
        if matrix.ndim != 2 or 0 in matrix.shape or not np.all(np.isfinite(matrix)):
            raise ValueError(f"{name} has shape {matrix.shape}: expected a matrix of finite numbers, a list of rows")
    a, b, c = matrices
    n = len(a)
    if a.shape != (n, n) or b.shape != (n, 1) or c.shape not in ((1, n), (2, n)):
        raise ValueError(f"A is {a.shape[0]} x {a.shape[1]}, B {b.shape[0]} x {b.shape[1]}, C {c.shape[0]} x "
                         f"{c.shape[1]}: expected n x n, n x 1 and 1 x n, or 2 x n with the integral of y")
    if len(c) == 1:
        return Agent(a, b, c), None
    k = int(np.argmax(c[1]))
    if not (np.array_equal(c[1], np.eye(n)[k]) and np.array_equal(a[k], c[0]) and b[k, 0] == 0 and not a[:, k].any()):
        raise ValueError(f"C[2]={c[1].tolist()}: expected one state, whose row of A is C[1], whose row of B and column "
                         "of A are zero: the integral of the output, from which a robot takes the mean")
    kept = [state for state in range(n) if state != k]
    return Agent(a[np.ix_(kept, kept)], b[kept], c[:1, kept]), k
