"""The dissertation's tables, computed again: each printed number beside ours, with the band in which ours has to lie.

A member of this kind is a `Table`: rows with the printed numbers, and a method that measures ours row by row.
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
        """True if the printed value lies in the band; None if none is printed or the band has only one side."""
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
        """True if our value lies in the band; None if there is no band or no value."""
        low, high = self.row.low, self.row.high
        if self.ours is None or (low is None and high is None):
            return None
        return (low is None or self.ours >= low) and (high is None or self.ours <= high)


class Table(Protocol):
    title: str
    judged_by: str                      # origin of the bands, one sentence
    runs: int                           # default number of runs

    def steps(self, runs: int) -> int:
        """Return the number of calls of `progress` for `runs` runs."""

    def measure(self, runs: int, progress: Callable[[], None]) -> Iterator[Measured]: ...
