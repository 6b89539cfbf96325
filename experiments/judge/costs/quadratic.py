"""The quadratic cost of a linear-quadratic (LQ) control problem over the run [0, T]:

    J = integral of z' W z dt,    z = the signals of `of`, each held from sample to sample

With z = (x, u) and W = diag(Q, R) that is the integral of x'Qx + u'Ru (B. Anderson, J. Moore 1990). The integral over
the held samples is exact. Each weight has the unit that makes its term a pure number per second.
Not modelled: signals between samples, a terminal cost (bound the signal at the end).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import ClassVar

import numpy as np

from experiments.judge.costs import NotAccrued
from experiments.judge.formula.curve import Curve, Floats
from experiments.judge.groups import Ints
from experiments.judge.run_data import RunData
from experiments.scenario.subjects import Named

NS_PER_S = 1e9
LEAST_EIGENVALUE = -1e-9                # of the weights, relative to the largest: what rounding may leave below 0


@dataclass(frozen=True)
class Quadratic:
    ON: ClassVar = Named.SIGNALS
    UNIT: ClassVar = ""

    of: tuple[str, ...]                             # "node.signal"
    weights: list[float] | list[list[float]]        # the diagonal of W, or W

    def __post_init__(self) -> None:
        count = len(self.of)
        if not count:
            raise ValueError("of=[]: expected at least one signal, \"node.signal\"")
        rows = [row if isinstance(row, list) else [row] for row in self.weights]
        whole = any(isinstance(row, list) for row in self.weights)
        if len(rows) != count or (whole and any(len(row) != count for row in rows)):
            raise ValueError(f"weights={self.weights}: expected {count} numbers, or {count} lists of {count}, for the "
                             f"{count} signals of `of`")
        if not np.array_equal(self._matrix(), self._matrix().T):
            raise ValueError(f"weights={self.weights}: expected a symmetric matrix")
        least = np.linalg.eigvalsh(self._matrix())
        if least[0] < LEAST_EIGENVALUE * max(abs(least[0]), abs(least[-1])):
            raise ValueError(f"weights={self.weights}: expected no negative eigenvalue, or the cost could fall; the "
                             f"least is {least[0]:.3g}")

    @property
    def subjects(self) -> Sequence[str]:
        return self.of

    def accrue(self, data: RunData) -> Mapping[str, Curve]:
        columns = [self._column(place, data) for place in self.of]
        at = reduce(np.union1d, [instants for instants, _ in columns])
        at = np.r_[0, at[(at > 0) & (at < data.length_ns)]]
        z = np.column_stack([values[np.maximum(np.searchsorted(instants, at, side="right") - 1, 0)]
                             for instants, values in columns])
        t = np.r_[at, data.length_ns].astype(np.float64)
        rate = np.einsum("ki,ij,kj->k", z, self._matrix(), z)
        total = np.r_[0.0, np.cumsum(rate * np.diff(t) / NS_PER_S)]
        return {"": Curve(t, total[:-1], total[1:])}

    def _matrix(self) -> Floats:
        given = np.array(self.weights, dtype=np.float64)
        return given if given.ndim == 2 else np.diag(given)

    def _column(self, place: str, data: RunData) -> tuple[Ints, Floats]:
        node, _, signal = place.partition(".")
        if node not in data.signals or signal not in data.signals[node].names:
            raise NotAccrued(f"the run has no signal {place}")
        table = data.signals[node]
        if not table.time_ns.size:
            raise NotAccrued(f"{place} was never sampled")
        values = table.column(signal)
        if np.isnan(values[table.time_ns < data.length_ns]).any():
            raise NotAccrued(f"{place} is not a number at some instant")
        return table.time_ns, values
