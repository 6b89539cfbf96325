"""Guides an investigation: to the observation cell of the greatest reward, where the sensor stands or sweeps.

With `sweeps` it moves to and fro across the C-target (section 2.1; Figure 2.3, line 42; `agents.marco_polo.sweep`), at
the distance along the bisector at which it finds the target with the greatest probability from its arrival on. The
reward (2.4), by which its cell was chosen, does not count the time that the sensor needs to come there; the maneuver
does, so it is often elsewhere.
The investigation ends at the latest time at which the target can be in its C-target (`agents.marco_polo.legs`).
"""

from __future__ import annotations

from itertools import cycle, islice
from math import dist
from typing import Final

import numpy as np

from agents.marco_polo.c_target import CTarget
from agents.marco_polo.sweep import plan_sweep, sweep_probability
from agents.marco_polo_game.guidance import Deck, Deployment, Guidance, Plan, longest_stay_ns
from agents.pursuit import Place
from netem.records.event_fields import OVER, written

SHARES: Final = (1.0, 0.75, 0.5, 0.25)      # of the amplitude, if walls or obstacles are in the way of all of it


class Investigation(Guidance):
    lost = "the target has left its C-target"

    def __init__(self, deck: Deck) -> None:
        self._deck = deck
        self._ends_ns = 0
        self._way: list[Place] = []
        self._of = ""                           # name of the target
        self._sweep: list[Place] = []

    @property
    def ends_ns(self) -> int:
        return self._ends_ns

    def begin(self, deployment: Deployment, now_ns: int) -> None:
        game, parameters, forecast = self._deck.game, self._deck.game.parameters, deployment.track.forecast()
        target = CTarget(forecast.track, game.radius_m[self._deck.board.name], parameters.cone_content)
        self._ends_ns = forecast.seen_ns + longest_stay_ns(target, game)
        self._of = game.targets[deployment.target]
        self._deck.board.event("C-target", written({"target": self._of, "corners_m": target.outline(game.area)}))
        self._way = [self._deck.ground.cells.centroid(cell) for cell in deployment.offer.route.cells]
        self._sweep = []
        if parameters.sweeps:
            self._begin_sweep(target, deployment.own, now_ns, forecast.seen_ns)

    def plan(self, own: Place, now_ns: int) -> Plan | None:
        if now_ns >= self._ends_ns:
            return None
        way, ground = self._way, self._deck.ground
        if not ground.clear(own, way[0]):
            way = ground.way(self._deck.graph(), own, way[-1])
        return Plan([*way, *self._sweep], self._ends_ns)

    def end(self) -> None:
        self._deck.board.event(f"C-target{OVER}", written({"target": self._of}))
        self._way, self._sweep = [], []

    def _begin_sweep(self, target: CTarget, own: Place, now_ns: int, seen_ns: int) -> None:
        """Plan the way to the best maneuver, and its turns until the end; without a place for one, leave all as it is.
        """
        ground, parameters, graph = self._deck.ground, self._deck.game.parameters, self._deck.graph()
        speed_mps = self._deck.game.speed_mps(self._deck.board.name)
        target_mps = parameters.target_least_mps, parameters.target_greatest_mps
        best = 0.0
        for along_m in np.arange(0.0, target.depth_m(self._deck.game.area), parameters.cell_m).tolist():
            sweep, centre = plan_sweep(target, along_m, speed_mps), target.place(along_m, 0.0)
            begin_ns = now_ns + round(dist(own, centre) / speed_mps * 1e9)
            found = sweep_probability(sweep, target.radius_m, target_mps, (begin_ns - seen_ns) * 1e-9)
            if found <= best or not self._fits(centre):
                continue
            way = ground.way(graph, own, centre)
            if not way or not ground.clear(way[-1], centre):
                continue
            right, left = (self._farthest(target, centre, along_m, side * sweep.amplitude_m) for side in (1.0, -1.0))
            way_m, lasts_s = dist(right, left), (self._ends_ns - begin_ns) * 1e-9
            turns = max(0, int(speed_mps * lasts_s / way_m)) + 2 if way_m > 0.0 else 1
            best, self._way = found, [*way, centre]
            self._sweep = list(islice(cycle((right, left)), turns))

    def _fits(self, place: Place) -> bool:
        """Return whether the platform is inside the area and overlaps no obstacle."""
        (x, y), half_m, area = place, 0.5 * self._deck.game.parameters.platform_m, self._deck.game.area
        corners = (x - half_m, y - half_m), (x + half_m, y + half_m)
        return all(area.nearest(corner) == corner for corner in corners) and self._deck.ground.clear(place, place)

    def _farthest(self, target: CTarget, centre: Place, along_m: float, across_m: float) -> Place:
        """Return the turn of the sweep, or one nearer to its centre if walls or obstacles are in the way."""
        for share in SHARES:
            place = target.place(along_m, share * across_m)
            if self._fits(place) and self._deck.ground.clear(centre, place):
                return place
        return centre
