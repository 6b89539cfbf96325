"""Whether the zones that planners avoid, `team.zones`, are those in which the radio is weak, `zones` of its topology.

Either list may be left out: a game may have zones for planners alone, or for the radio alone. Where both are given, a
zone of the radio has to be covered by one of `team.zones`, as far as it is in the area, or a sensor drives to where it
is not heard; and one of `team.zones` has to meet a zone of the radio, or planners avoid a place for nothing.
Not modelled: a zone of the radio that several of `team.zones` cover together, which is refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from agents.marco_polo.cells import Polygon
from agents.marco_polo.convex_polygon import TOUCHING_M, ConvexPolygon
from agents.marco_polo_game.game_table import Game
from agents.pursuit.law import Area
from firmware_sim.scenario_view import MediumView
from netem.topology import WeakArea


@dataclass(frozen=True)
class _InArea:
    """A zone of the radio, as far as it is in the area of a game; exact along x and y."""

    area: Area
    zone: WeakArea

    def extent_m(self, ux: float, uy: float) -> float:
        (x0, x1), (y0, y1) = self.area.x_m, self.area.y_m
        return min(self.zone.extent_m(ux, uy), max(ux * x0, ux * x1) + max(uy * y0, uy * y1))

    def sides_m(self) -> tuple[float, float, float, float]:
        """Return x from, x to, y from, y to; from is greater than to for a zone outside the area."""
        return -self.extent_m(-1, 0), self.extent_m(1, 0), -self.extent_m(0, -1), self.extent_m(0, 1)

    def meets(self, corners: Polygon) -> bool:
        x0, x1, y0, y1 = self.sides_m()
        xs, ys = zip(*corners, strict=True)
        return (min(xs) < x1 and max(xs) > x0 and min(ys) < y1 and max(ys) > y0
                and ConvexPolygon(corners).gap_m(self.extent_m) < 0)


def zone_problems(game: Game, medium: MediumView) -> Iterator[str]:
    """Yield the zones of one list that have no counterpart in the other; nothing if one of the lists is empty."""
    if medium.settings.radio() is None:
        return
    weak = medium.settings.topology.weak_areas()
    if not weak or not game.zones:
        return
    where = f"media.{medium.name}.topology.zones"
    inside = [_InArea(game.area, zone) for zone in weak]
    for number, corners in enumerate(game.zones):
        if not any(zone.meets(corners) for zone in inside):
            told = ", ".join(f"({x:g}, {y:g})" for x, y in corners)
            yield (f"team.zones[{number}]={told} m: meets none of {where}, so planners avoid a place where the radio "
                   f"works; give the radio a zone there, remove this one, or remove {where} altogether")
    for number, zone in enumerate(inside):
        x0, x1, y0, y1 = zone.sides_m()
        if x0 > x1 or y0 > y1:
            continue
        out_m, nearest = min((ConvexPolygon(corners).protrusion_m(zone.extent_m), index)
                             for index, corners in enumerate(game.zones))
        if out_m > TOUCHING_M:
            yield (f"{where}[{number}] (x {x0:g} to {x1:g}, y {y0:g} to {y1:g} m): protrudes by {out_m:.3g} m from "
                   f"team.zones[{nearest}], so sensors drive to where nobody hears them; have one of team.zones cover "
                   f"it, [[{x0:g}, {y0:g}], [{x1:g}, {y0:g}], [{x1:g}, {y1:g}], [{x0:g}, {y1:g}]] would do, or "
                   "remove team.zones altogether")
