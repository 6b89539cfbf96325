"""The samples of one node as arrays, as read from a signals file, kept in memory, or derived."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class SignalTable:
    """Samples of one node: `values[k, column]` at `time_ns[k]`, columns as in `names`; nan where not finite."""

    node: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    time_ns: NDArray[np.int64]
    values: NDArray[np.float64]

    def column(self, name: str) -> NDArray[np.float64]:
        return self.values[:, self.names.index(name)]
