"""Strict bounds on a number that a node reports: below one value, above another.

A value holds from its report to the next; nan is not within the bounds.

    violated:  from a report that is not within the bounds, until one that is

Before the first report nothing is violated; without any report the guarantee is not judged.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import inf, nan
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.judge.groups import Ints, new_group
from experiments.judge.monitors.outcome import Finding, Violation, finite

Floats = NDArray[np.float64]


class Reports(NamedTuple):
    """Values of one subject, `node.name`, in the order of time."""

    node: str
    name: str
    time_ns: Ints
    values: Floats
    said: Sequence[str] | None = None       # the texts that begin with the values, if they come from texts


@dataclass(frozen=True)
class ValueBounds:
    UNIT: ClassVar = ""

    below: float | None = None
    above: float | None = None

    def __post_init__(self) -> None:
        if self.below is None and self.above is None:
            raise ValueError("guarantees nothing; give below, above or both")
        if self.below is not None and self.above is not None and self.below <= self.above:
            raise ValueError(f"below={self.below}: nothing lies between it and above={self.above}")

    def requires(self) -> str:
        return " and ".join(f"{word} {bound:g}" for word, bound in (("above", self.above), ("below", self.below))
                            if bound is not None)

    def judge(self, reports: Iterable[Reports], length_ns: int) -> Finding:
        violations: list[Violation] = []
        nearest: list[tuple[float, float]] = []             # (what is left, value) of each subject
        for node, name, time_ns, values, said in reports:
            seen = int(np.searchsorted(time_ns, length_ns))
            if not seen:
                continue
            left = self._left(values[:seen])
            k = int(left.argmin())                          # the first nan, if there is one
            nearest.append((float(left[k]), float(values[k])))
            violations += _violations(Reports(node, name, time_ns[:seen], values[:seen], said), left, length_ns)
        if not nearest:
            return Finding(judged=False)
        margin, worst = min(nearest, key=lambda pair: pair[0] if pair[0] == pair[0] else -inf)
        return Finding(violations, worst, margin)

    def _left(self, values: Floats) -> Floats:
        """Distance of each value to the nearer bound, negative beyond it."""
        left = np.where(np.isnan(values), nan, inf)
        if self.below is not None:
            left = np.minimum(left, self.below - values)
        if self.above is not None:
            left = np.minimum(left, values - self.above)
        return left


def _violations(reports: Reports, left: Floats, length_ns: int) -> Iterator[Violation]:
    node, name, time_ns, values, said = reports
    kept = left > 0                                         # false for nan
    starts = np.flatnonzero(new_group(kept.astype(np.int64)))
    ends = np.r_[starts[1:], time_ns.size]
    for start, end in zip(starts, ends, strict=True):
        if not kept[start]:
            until_ns = int(time_ns[end]) if end < time_ns.size else length_ns
            worst = float(values[start + int(left[start:end].argmin())])
            yield Violation(f"{node}.{name}", node, int(time_ns[start]), until_ns, finite(worst),
                            f"it is {values[start]:.6g}" if said is None else f"it is {said[int(start)].strip()}")
