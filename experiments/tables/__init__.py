"""The dissertation's tables, computed again: each number printed beside ours, and what ours has to be.

A member of this kind is a `Table`: rows that are known beforehand, and a way to measure them one after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple, Protocol


@dataclass(frozen=True)
class Row:
    what: str                           # "31 detections, UKF"
    quantity: str                       # "RMSE"
    unit: str                           # "m"
    printed: float | None
    printed_variance: float | None = None
    low: float | None = None            # what has to be met; None: open, or with the other one None: not to be met
    high: float | None = None


class Measured(NamedTuple):
    row: Row
    ours: float | None                  # None: cannot be measured here
    variance: float | None
    runs: int

    @property
    def standard_error(self) -> float | None:
        return None if self.variance is None else (self.variance / self.runs) ** 0.5

    @property
    def met(self) -> bool | None:
        """None: nothing has to be met, or cannot be measured."""
        low, high = self.row.low, self.row.high
        if self.ours is None or (low is None and high is None):
            return None
        return (low is None or self.ours >= low) and (high is None or self.ours <= high)


class Table(Protocol):
    title: str
    runs: int                           # by default

    def steps(self, runs: int) -> int:
        """How often `progress` will be called."""
        ...

    def measure(self, runs: int, progress: Callable[[], None]) -> Iterator[Measured]: ...
