"""Zones of poor communication: areas on the ground that weaken a link.

    acts_on = "ends"      a link with at least one end inside or on the edge (fog, a hall of steel)
    acts_on = "path"      also a link whose straight line meets the zone with both ends outside (a wall, a container)

A zone adds its loss once to a link. Distances are horizontal: a zone is as high as the sky.
Not modelled: loss that grows with the length of the way through a zone, diffraction around it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, dist, hypot, sin, tau
from typing import Annotated, Literal

from netem.topology import Position
from netem.topology.told_apart import ToldApartBy

ActsOn = Literal["ends", "path"]
SIDES = 48                          # of the polygon that is drawn for a circle


@dataclass(frozen=True)
class Rectangle:
    kind: Literal["rectangle"]
    low_m: tuple[float, float]
    high_m: tuple[float, float]
    extra_loss_db: float
    acts_on: ActsOn = "ends"

    def __post_init__(self) -> None:
        if not (self.low_m[0] <= self.high_m[0] and self.low_m[1] <= self.high_m[1]):
            raise ValueError(f"low_m={self.low_m}: expected at most high_m={self.high_m} in both coordinates")

    def holds(self, at_m: Position) -> bool:
        return all(low <= x <= high for low, x, high in zip(self.low_m, at_m, self.high_m, strict=False))

    def extent_m(self, ux: float, uy: float) -> float:
        return max(ux * self.low_m[0], ux * self.high_m[0]) + max(uy * self.low_m[1], uy * self.high_m[1])

    def outline_m(self) -> Sequence[tuple[float, float]]:
        (west, south), (east, north) = self.low_m, self.high_m
        return (west, south), (east, south), (east, north), (west, north)

    def weakens(self, one_m: Position, other_m: Position) -> bool:
        if self.holds(one_m) or self.holds(other_m):
            return True
        return self.acts_on == "path" and self._crossed(one_m, other_m)

    def _crossed(self, one_m: Position, other_m: Position) -> bool:
        """Clip the segment to the slabs of both coordinates (Liang and Barsky 1984); the edge counts as inside."""
        enters, leaves = 0.0, 1.0
        for axis in (0, 1):
            start, step = one_m[axis], other_m[axis] - one_m[axis]
            if step == 0:
                if not self.low_m[axis] <= start <= self.high_m[axis]:
                    return False
                continue
            first, last = sorted(((self.low_m[axis] - start) / step, (self.high_m[axis] - start) / step))
            enters, leaves = max(enters, first), min(leaves, last)
        return enters <= leaves


@dataclass(frozen=True)
class Circle:
    kind: Literal["circle"]
    centre_m: tuple[float, float]
    radius_m: float
    extra_loss_db: float
    acts_on: ActsOn = "ends"

    def __post_init__(self) -> None:
        if self.radius_m < 0:
            raise ValueError(f"radius_m={self.radius_m}: expected radius_m >= 0")

    def holds(self, at_m: Position) -> bool:
        return dist(self.centre_m, tuple(at_m)[:2]) <= self.radius_m

    def extent_m(self, ux: float, uy: float) -> float:
        return ux * self.centre_m[0] + uy * self.centre_m[1] + self.radius_m * hypot(ux, uy)

    def outline_m(self) -> Sequence[tuple[float, float]]:
        x, y = self.centre_m
        return [(x + self.radius_m * cos(angle), y + self.radius_m * sin(angle))
                for angle in (tau * side / SIDES for side in range(SIDES))]

    def weakens(self, one_m: Position, other_m: Position) -> bool:
        if self.holds(one_m) or self.holds(other_m):
            return True
        return self.acts_on == "path" and self._crossed(one_m, other_m)

    def _crossed(self, one_m: Position, other_m: Position) -> bool:
        along_x, along_y = other_m[0] - one_m[0], other_m[1] - one_m[1]
        to_x, to_y = self.centre_m[0] - one_m[0], self.centre_m[1] - one_m[1]
        length2 = along_x * along_x + along_y * along_y
        share = min(1.0, max(0.0, (to_x * along_x + to_y * along_y) / length2)) if length2 else 0.0
        return hypot(to_x - share * along_x, to_y - share * along_y) <= self.radius_m


Zone = Annotated[Rectangle | Circle, ToldApartBy("kind")]
