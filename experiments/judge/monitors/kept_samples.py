"""Samples kept in memory: the monitors of signals judge before the file of the signals is closed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from netem.records.signal_table import SignalTable


class KeptSamples:
    def __init__(self) -> None:
        self._samples: dict[str, list[tuple[int, Sequence[float]]]] = {}

    def append(self, node: str, time_ns: int, values: Sequence[float]) -> None:
        self._samples.setdefault(node, []).append((time_ns, values))

    def tables(self, declared: Mapping[str, Sequence[tuple[str, str]]]) -> dict[str, SignalTable]:
        """Return the tables of all samples, by node; `declared` are the (name, unit) pairs of each node's signals."""
        return {node: SignalTable(node, tuple(name for name, _ in signals), tuple(unit for _, unit in signals),
                                  *_arrays(self._samples.get(node, []), len(signals)))
                for node, signals in declared.items()}


def _arrays(samples: Sequence[tuple[int, Sequence[float]]],
            signals: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    return (np.array([time_ns for time_ns, _ in samples], dtype=np.int64),
            np.array([values for _, values in samples], dtype=np.float64).reshape(len(samples), signals))
