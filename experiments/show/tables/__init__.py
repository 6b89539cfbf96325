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
    low: float | None = None            # the band that ours has to lie in; None: open, both None: ours is not judged
    high: float | None = None

    @property
    def reproduced(self) -> bool | None:
        """Whether the printed value lies in the band. None: nothing is printed, or the band is no more than a limit."""
        if self.printed is None or self.low is None or self.high is None:
            return None
        return self.low <= self.printed <= self.high


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
    judged_by: str                      # where the bands come from, one sentence
    runs: int                           # by default

    def steps(self, runs: int) -> int:
        """How often `progress` will be called."""
        ...

    def measure(self, runs: int, progress: Callable[[], None]) -> Iterator[Measured]: ...
