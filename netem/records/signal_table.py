"""The samples of one node as arrays, as read from a signals file, kept in memory, or derived."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class SignalTable:
    """Samples of one node: `values[k, column]` at `time_ns[k]`, columns as in `names`; nan where not finite.

    `dead_ns` are the intervals [start, end) in which a fault had killed the node, whose program then has no values.
    """

    node: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    time_ns: NDArray[np.int64]
    values: NDArray[np.float64]
    dead_ns: tuple[tuple[int, int], ...] = ()

    def column(self, name: str) -> NDArray[np.float64]:
        return self.values[:, self.names.index(name)]

    def sampled(self, name: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return the instants and the values of one signal, without those that a dead program did not give."""
        values = self.column(name)
        absent = np.zeros(values.size, dtype=np.bool_)
        for start_ns, end_ns in self.dead_ns:
            absent |= (start_ns <= self.time_ns) & (self.time_ns < end_ns)
        absent &= np.isnan(values)
        return (self.time_ns[~absent], values[~absent]) if absent.any() else (self.time_ns, values)


def with_deaths(tables: Mapping[str, SignalTable],
                dead_ns: Mapping[str, Sequence[Sequence[int]]]) -> dict[str, SignalTable]:
    """Return the tables, by node, with the intervals in which a fault had killed their nodes."""
    return {node: replace(table, dead_ns=tuple((start_ns, end_ns) for start_ns, end_ns in dead_ns[node]))
            if node in dead_ns else table for node, table in tables.items()}
