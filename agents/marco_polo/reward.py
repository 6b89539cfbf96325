"""The reward (2.4) of sending a sensor to a cell, and the cell with the greatest.

    R = w_R P_R(goal) + w_S (P_S^k(goal) - P_S^k(start)) - w_d length / diagonal

P_R: probability that the sensor detects the target from the goal; P_S^k: track coverage of the whole team with this
sensor there; length: that of the route; diagonal: the area's. For an investigation the goals are the observation
cells; for a pursuit the only goal is the cell of the newest detection, and the distance has the greater weight.

Differs from the dissertation:
- (2.4) adds probabilities to metres; here weights are parameters and lengths are relative to the area's diagonal.
- (2.4) is a reward of each edge, and with cycles of positive reward there is no best path; here P_R and Delta P_S^k
  count once, at the goal, and the route's length is the cost. A* finds the best goal and the shortest route to it.
- Figure 2.3, line 44, offers every sensor for the pursuit; the caller offers UGVs only, as the text has it.

Source: dissertation, (2.4) and section 2.2.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from agents.marco_polo.connectivity import ConnectivityGraph, Route
from agents.marco_polo.detection_probability import detection_probability, observation_cells
from agents.marco_polo.track_coverage import BOUNDARY_CELLS, coverage_with
from agents.marco_polo.track_line import TrackLine
from agents.pursuit import Place


@dataclass(frozen=True)
class RewardWeights:
    detection: float            # w_R, >= 0
    coverage: float             # w_S, >= 0
    distance: float             # w_d, > 0

    def __post_init__(self) -> None:
        for name in ("detection", "coverage", "distance"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise ValueError(f"reward weight {name}={getattr(self, name)}: expected 0 or more")
        if self.distance == 0:
            raise ValueError("reward weight distance=0: expected more than 0, such as 0.01, so that the shortest of "
                             "equally good routes is taken")


INVESTIGATION = RewardWeights(detection=1.0, coverage=1.0, distance=0.5)
PURSUIT = RewardWeights(detection=0.2, coverage=0.2, distance=1.0)


class Offer(NamedTuple):
    """What a sensor bids: its greatest reward and how it is earned."""

    reward: float
    goal: int                   # cell
    route: Route
    detection: float            # P_R(goal)
    coverage_gain: float        # Delta P_S^k(start, goal)


@dataclass(frozen=True)
class Sensor:
    """A sensor that can be deployed, and the others of its team."""

    place: Place
    radius_m: float
    others_m: ArrayLike         # places of the other sensors, (n, 2)
    other_radii_m: ArrayLike    # (n,)


def investigation_offer(sensor: Sensor, graph: ConnectivityGraph, track: TrackLine, k: int, threshold: float,
                        weights: RewardWeights = INVESTIGATION, boundary_cells: int = BOUNDARY_CELLS) -> Offer | None:
    """Return the best offer over all observation cells that the sensor can reach; None if there is none."""
    goals = observation_cells(graph.cells, graph.free, track, sensor.radius_m, threshold)
    return _best(sensor, graph, track, k, goals.tolist(), weights, boundary_cells)


def pursuit_offer(sensor: Sensor, graph: ConnectivityGraph, track: TrackLine, detection: Place, k: int,
                  weights: RewardWeights = PURSUIT, boundary_cells: int = BOUNDARY_CELLS) -> Offer | None:
    """Return the offer of driving to the newest detection, or to the reachable cell nearest to it; None without any."""
    start = _start(sensor, graph)
    goal = None if start is None else graph.nearest(detection, graph.reachable(start))
    return None if goal is None else _best(sensor, graph, track, k, [goal], weights, boundary_cells)


def _start(sensor: Sensor, graph: ConnectivityGraph) -> int | None:
    return graph.nearest(sensor.place)


def _best(sensor: Sensor, graph: ConnectivityGraph, track: TrackLine, k: int, goals: list[int], weights: RewardWeights,
          boundary_cells: int) -> Offer | None:
    start = _start(sensor, graph)
    if start is None or not goals:
        return None
    area = graph.cells.area
    places = graph.cells.centroids_m[goals]
    detection = detection_probability(area, track, places, sensor.radius_m)
    covered = coverage_with(area, sensor.others_m, sensor.other_radii_m, k, np.vstack([[sensor.place], places]),
                            sensor.radius_m, boundary_cells=boundary_cells)
    gain = covered[1:] - covered[0]
    value = weights.detection * detection + weights.coverage * gain
    diagonal = hypot(area.x_m[1] - area.x_m[0], area.y_m[1] - area.y_m[0])
    cost_per_m = weights.distance / diagonal
    route = graph.best_route(start, dict(zip(goals, value.tolist(), strict=True)), cost_per_m)
    if route is None:
        return None
    at = goals.index(route.cells[-1])
    return Offer(float(value[at]) - cost_per_m * route.length_m, route.cells[-1], route, float(detection[at]),
                 float(gain[at]))
