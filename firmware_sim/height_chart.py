"""A chart of heights over a plane that a program class shows of what its `prepare` made before the run.

    @staticmethod
    def charts(scenario, own) -> Iterable[HeightChart]      given what `prepare` is given

A runner whose records are a folder asks before the run and keeps the charts there; the report draws them. A class
without this method has none. The numbers of a chart reach no robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite


@dataclass(frozen=True)
class HeightChart:
    title: str
    note: str
    x_axis: str                             # "x1 [m]"
    y_axis: str
    unit: str                               # of the heights, "s"
    x: Sequence[float]                      # ascending
    y: Sequence[float]
    z: Sequence[Sequence[float]]            # the heights: a row for each y, a column for each x

    def __post_init__(self) -> None:
        for name, values in (("x", self.x), ("y", self.y)):
            if not all(map(isfinite, values)) or any(low >= high for low, high in pairwise(values)):
                raise ValueError(f"{self.title}: {name}={list(values)}: expected ascending numbers")
        if len(self.z) != len(self.y) or any(len(row) != len(self.x) for row in self.z):
            raise ValueError(f"{self.title}: z has {len(self.z)} rows of {sorted({len(row) for row in self.z})} "
                             f"heights: expected {len(self.y)} rows of {len(self.x)}, one for each y and x")
        if not all(isfinite(height) for row in self.z for height in row):
            raise ValueError(f"{self.title}: z has heights that are no finite numbers")
