"""Keeps the samples that go by to the recorder: the monitors of signals judge while the recorder's file is open."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from netem.records.signal_table import SignalTable

Append = Callable[[str, int, Sequence[float]], None]


class SampleTee:
    def __init__(self, append: Append) -> None:
        self._append = append
        self._samples: dict[str, list[tuple[int, Sequence[float]]]] = {}

    def append(self, node: str, time_ns: int, values: Sequence[float]) -> None:
        self._samples.setdefault(node, []).append((time_ns, values))
        self._append(node, time_ns, values)

    def tables(self, declared: Mapping[str, Sequence[tuple[str, str]]]) -> dict[str, SignalTable]:
        """What went by, by node; `declared` are the (name, unit) pairs of each node's signals."""
        return {node: SignalTable(node, tuple(name for name, _ in signals), tuple(unit for _, unit in signals),
                                  *_arrays(self._samples.get(node, []), len(signals)))
                for node, signals in declared.items()}


def _arrays(samples: Sequence[tuple[int, Sequence[float]]],
            signals: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    return (np.array([time_ns for time_ns, _ in samples], dtype=np.int64),
            np.array([values for _, values in samples], dtype=np.float64).reshape(len(samples), signals))
