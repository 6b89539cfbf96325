"""What the decisions of a Marco Polo game cost: `python -m benchmarks.marco_polo_step [SIDE_M]`.

The team of section 2.4 on a square of SIDE_M (10), cells of 0.5 m, an obstacle and a zone. Prints the median processor
time of each function in ms, over 60 calls.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from statistics import median
from time import process_time

import numpy as np

from agents.marco_polo.area_coverage import area_coverage
from agents.marco_polo.c_target import CTarget
from agents.marco_polo.cells import Cells, square
from agents.marco_polo.connectivity import ConnectivityGraph
from agents.marco_polo.detection_probability import observation_cells
from agents.marco_polo.reward import Sensor, investigation_offer, pursuit_offer
from agents.marco_polo.sweep import plan_sweep, sweep_probability
from agents.marco_polo.track_coverage import track_coverage
from agents.marco_polo.track_line import fit_track
from agents.pursuit.law import Area

CENTRES_M = np.array([(2.5, 2.5), (7.5, 7.5), (2.5, 7.5), (7.5, 2.5), (5.0, 5.0), (5.0, 1.5), (5.0, 8.5)])
RADII_M = np.array([1.5, 1.5, 1.0, 1.0, 1.0, 1.25, 1.25])
OBSTACLE = ((3.0, 5.5), (4.5, 5.5), (4.5, 7.0), (3.0, 7.0))
ZONE = ((7.5, 3.5), (9.5, 3.5), (9.5, 6.0), (7.5, 6.0))
CALLS = 60


def main(side_m: float = 10.0) -> None:
    area = Area((0.0, side_m), (0.0, side_m))
    cells = Cells(area, 0.5)
    others = [square((float(x), float(y)), 0.5) for x, y in CENTRES_M[:-1]]
    barriers = [OBSTACLE, ZONE, *others]
    free = cells.free(barriers, 0.5)
    graph = ConnectivityGraph(cells, free)
    track = fit_track([(1.0, 1.0), (2.0, 1.8)])
    target = CTarget(track, 1.25, 0.5)
    sensor = Sensor((5.0, 8.5), 1.25, CENTRES_M[:-1], RADII_M[:-1])
    last = cells.rows * cells.columns - 1
    parts: dict[str, Callable[[], object]] = {
        "obstacle map, 8 polygons": lambda: cells.free(barriers, 0.5),
        "connectivity graph": lambda: ConnectivityGraph(cells, free),
        "A*, corner to corner": lambda: graph.route(0, last),
        "P_R of all cells": lambda: observation_cells(cells, free, track, 1.25, 0.3),
        "P_S^1..7": lambda: track_coverage(area, CENTRES_M, RADII_M),
        "area coverage": lambda: area_coverage(area, CENTRES_M, RADII_M),
        "outline of the C-target": lambda: target.outline(area),
        "P_R of a sweep": lambda: sweep_probability(plan_sweep(target, 4.0, 1.2), 1.25, (0.3, 0.7)),
        "offer, investigation": lambda: investigation_offer(sensor, graph, track, 3, 0.3),
        "offer, pursuit": lambda: pursuit_offer(sensor, graph, track, (2.0, 1.8), 3),
    }
    print(f"{cells.columns} x {cells.rows} cells")
    for name, call in parts.items():
        call()
        spent = []
        for _ in range(CALLS):
            begin = process_time()
            call()
            spent.append(process_time() - begin)
        print(f"{name:28} {median(spent) * 1e3:7.2f} ms")


if __name__ == "__main__":
    main(*map(float, sys.argv[1:2]))
