"""Samples kept in memory, 8 bytes for each instant and value, for those who judge before the file is closed."""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence

import numpy as np

from netem.records.signal_table import SignalTable


class KeptSamples:
    def __init__(self) -> None:
        self._samples: dict[str, tuple[array[int], array[float]]] = {}

    def append(self, node: str, time_ns: int, values: Sequence[float]) -> None:
        kept = self._samples.get(node)
        if kept is None:
            kept = self._samples[node] = array("q"), array("d")
        kept[0].append(time_ns)
        kept[1].extend(values)

    def tables(self, declared: Mapping[str, Sequence[tuple[str, str]]]) -> dict[str, SignalTable]:
        """Return the tables of all samples, by node; `declared` are the (name, unit) pairs of each node's signals."""
        found = {}
        for node, signals in declared.items():
            times, values = self._samples.get(node, (array("q"), array("d")))
            found[node] = SignalTable(node, tuple(name for name, _ in signals), tuple(unit for _, unit in signals),
                                      np.array(times, dtype=np.int64),
                                      np.array(values, dtype=np.float64).reshape(len(times), len(signals)))
        return found
