"""Sets of points, as domains, guards and initial sets need them: each says which variables it reads, and in words what.

    Between("speed", 0, 2)         0 <= speed <= 2           All(a, b), AnyOf(a, b)      intersection, union
    Where("in S", ("x", "y"), f)   any other set, by a function

A point maps names of variables to numbers. A variable that is nan is in no interval.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf
from typing import Final, Protocol

Point = Mapping[str, float]


class Region(Protocol):
    @property
    def variables(self) -> frozenset[str]:
        """The variables that `holds` reads; the point has to have them."""

    def holds(self, point: Point) -> bool:
        """Return whether the point is in the set."""


@dataclass(frozen=True)
class Between:
    """A closed interval of one variable, widened by `tolerance` on both sides, which is for rounding errors."""

    variable: str
    least: float = -inf
    most: float = inf
    tolerance: float = 0.0

    def __post_init__(self) -> None:
        if not self.least <= self.most:
            raise ValueError(f"{self.variable}: least={self.least}, most={self.most}: expected least <= most")

    @property
    def variables(self) -> frozenset[str]:
        return frozenset({self.variable})

    def holds(self, point: Point) -> bool:
        return self.least - self.tolerance <= point[self.variable] <= self.most + self.tolerance

    def __str__(self) -> str:
        lower = "" if self.least == -inf else f"{self.least:g} <= "
        return f"{lower}{self.variable}" + ("" if self.most == inf else f" <= {self.most:g}")


@dataclass(frozen=True)
class Where:
    """The points for which `test` returns True; `text` says so in words."""

    text: str
    reads: tuple[str, ...]
    test: Callable[[Point], bool]

    @property
    def variables(self) -> frozenset[str]:
        return frozenset(self.reads)

    def holds(self, point: Point) -> bool:
        return self.test(point)

    def __str__(self) -> str:
        return self.text


class _Several:
    def __init__(self, *regions: Region) -> None:
        self.regions = regions

    @property
    def variables(self) -> frozenset[str]:
        return frozenset(name for region in self.regions for name in region.variables)


class All(_Several):
    """The points in every one of `regions`; with none of them, all points."""

    def holds(self, point: Point) -> bool:
        return all(region.holds(point) for region in self.regions)

    def __str__(self) -> str:
        return " and ".join(map(str, self.regions)) or "everywhere"


class AnyOf(_Several):
    """The points in at least one of `regions`; with none of them, no point."""

    def holds(self, point: Point) -> bool:
        return any(region.holds(point) for region in self.regions)

    def __str__(self) -> str:
        return " or ".join(f"({region})" for region in self.regions) or "nowhere"


EVERYWHERE: Final = All()
