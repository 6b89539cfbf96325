"""Guides an investigation: to the observation cell of the greatest reward, where the sensor stands or sweeps.

With `sweeps` it moves to and fro across the C-target (section 2.1; Figure 2.3, line 42; `agents.marco_polo.sweep`), at
the distance along the bisector at which its cell is, if that finds the target with a greater probability than standing
there on the bisector does, from its arrival on.
The investigation ends at the latest time at which the target can be in its C-target (`agents.marco_polo.legs`).
"""

from __future__ import annotations

from dataclasses import replace
from itertools import cycle, islice
from math import dist
from typing import Final

from agents.marco_polo.c_target import CTarget
from agents.marco_polo.legs import longest_stay_s
from agents.marco_polo.sweep import plan_sweep, sweep_probability
from agents.marco_polo_game.guidance import Deck, Deployment, Guidance, Plan
from agents.pursuit import Place

SHARES: Final = (1.0, 0.75, 0.5, 0.25)      # of the amplitude, if walls or obstacles are in the way of all of it


class Investigation(Guidance):
    lost = "the target has left its C-target"

    def __init__(self, deck: Deck) -> None:
        self._deck = deck
        self._ends_ns = 0
        self._way: list[Place] = []
        self._sweep: list[Place] = []

    @property
    def ends_ns(self) -> int:
        return self._ends_ns

    def begin(self, deployment: Deployment, now_ns: int) -> None:
        game, parameters, forecast = self._deck.game, self._deck.game.parameters, deployment.track.forecast()
        target = CTarget(forecast.track, game.radius_m[self._deck.board.name], parameters.cone_content)
        stay_s = longest_stay_s(target.depth_m(game.area), parameters.target_least_mps,
                                0.5e-9 * (parameters.turn_least_ns + parameters.turn_greatest_ns))
        self._ends_ns = forecast.seen_ns + round(stay_s * 1e9)
        self._way = [self._deck.ground.cells.centroid(cell) for cell in deployment.offer.route.cells]
        if parameters.sweeps:
            speed_mps = game.speed_mps(self._deck.board.name)
            begin_ns = now_ns + round(deployment.offer.route.length_m / speed_mps * 1e9)
            self._sweep = self._turns(target, self._way[-1], speed_mps, (begin_ns - forecast.seen_ns) * 1e-9,
                                      (self._ends_ns - begin_ns) * 1e-9)

    def plan(self, own: Place, now_ns: int) -> Plan | None:
        if now_ns >= self._ends_ns:
            return None
        way, ground = self._way, self._deck.ground
        if not ground.clear(own, way[0]):
            way = ground.way(self._deck.graph(), own, way[-1])
        return Plan([*way, *self._sweep], self._ends_ns)

    def end(self) -> None:
        self._way, self._sweep = [], []

    def _turns(self, target: CTarget, cell: Place, speed_mps: float, begin_s: float, lasts_s: float) -> list[Place]:
        """Return the places between which the sensor goes to and fro until the end; none if standing is as good.

        It is at its `cell` `begin_s` after the newest detection, and `lasts_s` before the end."""
        parameters = self._deck.game.parameters
        sweep = plan_sweep(target, max(0.0, float(target.along_and_across_m(cell)[0])), speed_mps)
        target_mps = parameters.target_least_mps, parameters.target_greatest_mps
        moving, standing = (sweep_probability(each, target.radius_m, target_mps, begin_s)
                            for each in (sweep, replace(sweep, amplitude_m=0.0)))
        if moving <= standing:
            return []
        right, left = (self._farthest(target, cell, sweep.along_m, side * sweep.amplitude_m) for side in (1.0, -1.0))
        way_m = dist(right, left)
        if way_m < parameters.cell_m or not self._deck.ground.clear(right, left):
            return []
        return list(islice(cycle((right, left)), 2 + max(0, int(speed_mps * lasts_s / way_m))))

    def _farthest(self, target: CTarget, cell: Place, along_m: float, across_m: float) -> Place:
        """Return the place nearest to the turn of the sweep whose platform is inside, with a clear leg from the cell.
        """
        area, half_m = self._deck.game.area, 0.5 * self._deck.game.parameters.platform_m
        for share in SHARES:
            x, y = place = target.place(along_m, share * across_m)
            corners = (x - half_m, y - half_m), (x + half_m, y + half_m)
            if all(area.nearest(corner) == corner for corner in corners) and self._deck.ground.clear(cell, place):
                return place
        return cell
