"""What a program knows of the ground on which its team acts: the area, and what stands or lies in it.

    @staticmethod
    def ground_plan(settings, team) -> GroundPlan       settings: None without `Settings`; team: the table [team]

The report draws it below the robots. A class without this method has none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

Place = tuple[float, float]
LEAST_CORNERS = 3


@dataclass(frozen=True)
class GroundShape:
    """A polygon; `what` is its name in the legend, as "obstacle". Nothing can be where it is `solid`."""

    what: str
    corners_m: tuple[Place, ...]
    solid: bool = True

    def __post_init__(self) -> None:
        if len(self.corners_m) < LEAST_CORNERS or not all(isfinite(value) for at in self.corners_m for value in at):
            raise ValueError(f"{self.what}: corners_m={list(self.corners_m)}: expected {LEAST_CORNERS} or more corners "
                             "with finite x, y [m]")


@dataclass(frozen=True)
class GroundPlan:
    area_x_m: tuple[float, float]       # from, to
    area_y_m: tuple[float, float]
    shapes: tuple[GroundShape, ...] = ()

    def __post_init__(self) -> None:
        for name, side in (("area_x_m", self.area_x_m), ("area_y_m", self.area_y_m)):
            if not (all(map(isfinite, side)) and side[0] < side[1]):
                raise ValueError(f"{name}={list(side)}: expected [from, to], from < to")


def joined(plans: Sequence[GroundPlan]) -> GroundPlan | None:
    """Return the smallest area that holds those of all plans, with all of their shapes, each once; None of no plans."""
    if not plans:
        return None
    xs, ys = [plan.area_x_m for plan in plans], [plan.area_y_m for plan in plans]
    shapes = dict.fromkeys(shape for plan in plans for shape in plan.shapes)
    return GroundPlan((min(low for low, _ in xs), max(high for _, high in xs)),
                      (min(low for low, _ in ys), max(high for _, high in ys)), tuple(shapes))
