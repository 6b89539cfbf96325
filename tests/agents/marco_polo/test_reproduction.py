"""The "ours" column of docs/reproduction.md, Chapter 2: computed here, row by row, so that the page cannot rot.

`pytest -s tests/agents/marco_polo/test_reproduction.py -k ROW` prints the row ROW.
"""

from math import degrees, pi

import numpy as np
import pytest

from agents.marco_polo.area_coverage import area_coverage, greatest_area_coverage
from agents.marco_polo.c_target import CTarget
from agents.marco_polo.cells import Cells
from agents.marco_polo.connectivity import ConnectivityGraph
from agents.marco_polo.detection_probability import detection_probability, observation_cells
from agents.marco_polo.game_parameters import GameParameters
from agents.marco_polo.legs import longest_stay_s
from agents.marco_polo.missed_chords import missed_share
from agents.marco_polo.sweep import plan_sweep, sweep_probability
from agents.marco_polo.track_coverage import Headings, track_coverage
from agents.marco_polo.track_line import fit_track
from tests.agents.marco_polo.layouts import AREA, CENTRES, OBSTACLE, PLACEMENTS, RADII, ZONE
from tests.agents.reproduction_page import documented

CELLS = Cells(AREA, 0.5)
TRACK = fit_track([(1.0, 1.0), (2.0, 1.8)])
GAME = GameParameters()
SPEEDS = (GAME.target_least_mps, GAME.target_greatest_mps)


def one(centre, headings=Headings.UNIFORM):
    return f"{track_coverage(AREA, [centre], 1.0, headings, 3200)[0]:.5f}"


def three(centres, headings=Headings.UNIFORM):
    return " ".join(f"{value:.4f}" for value in track_coverage(AREA, centres, RADII, headings, 800)[:3])


def placed(name, least_area=0.0):
    centres = np.array(PLACEMENTS[name])
    apart = np.max(np.abs(centres[:, None] - centres), axis=-1)[np.triu_indices(7, 1)]
    assert area_coverage(AREA, centres, RADII) >= least_area
    assert apart.min() >= 0.5 - 1e-9
    return f"{track_coverage(AREA, centres, RADII, boundary_cells=800)[2]:.4f}"


def route(start, goal, *obstacles):
    graph = ConnectivityGraph(CELLS, CELLS.free(obstacles, 0.5))
    return f"{graph.route(CELLS.cell_at(start), CELLS.cell_at(goal)).length_m:.4f} m"


def inside(content):
    """Share of positions inside the cone after 1, 3 and 10 legs of 1 m, 400 000 targets."""
    generator = np.random.default_rng(3)
    heading = generator.uniform(-pi / 2, pi / 2, (10, 400_000))
    along, across = np.cumsum(np.cos(heading), axis=0), np.cumsum(np.sin(heading), axis=0)
    target = CTarget(fit_track([(-1.0, 0.0), (0.0, 0.0)]), 1.25, content)
    return " ".join(f"{np.mean(target.contains(np.stack([along[n - 1], across[n - 1]], 1))):.3f}" for n in (1, 3, 10))


def swept(along):
    target = CTarget(TRACK, 1.25, 0.5)
    standing = detection_probability(AREA, TRACK, [target.place(along, 0.0)], 1.25)[0]
    sweep = plan_sweep(target, along, GAME.ugv_mps)
    return f"{standing:.2f}, {sweep_probability(sweep, 1.25, SPEEDS):.2f} with {sweep.amplitude_m:.3f} m"


def stay():
    target = CTarget(TRACK, 1.25, 0.5)
    leg_s = 0.5e-9 * (GAME.turn_least_ns + GAME.turn_greatest_ns)
    return f"{target.depth_m(AREA):.2f} m, {longest_stay_s(target.depth_m(AREA), SPEEDS[0], leg_s):.0f} s"


def exit_of_the_line():
    track = fit_track([(1.0, 1.0), (2.0, 2.2), (3.0, 2.9)])
    x, y = track.exit_point(AREA)
    centroid = f"({track.centroid[0]:.0f}, {track.centroid[1]:.4f})"
    return f"{centroid}, {degrees(track.heading_rad):.3f} deg, ({x:.0f}, {y:.3f})"


ROWS = {
    "disc-middle": lambda: one((5.0, 5.0)),
    "disc-corner": lambda: one((1.0, 1.0)),
    "disc-isotropic": lambda: one((5.0, 5.0), Headings.ISOTROPIC),
    "half-disc": lambda: one((5.0, 0.0), Headings.ISOTROPIC),
    "layout": lambda: three(CENTRES),
    "layout-isotropic": lambda: three(CENTRES, Headings.ISOTROPIC),
    "layout-area": lambda: f"{area_coverage(AREA, CENTRES, RADII):.4f}",
    "greatest-area": lambda: f"{greatest_area_coverage(AREA, RADII):.4f}",
    "placement-0": lambda: placed("two opposite corners"),
    "placement-0.25": lambda: placed("0.25", 0.25),
    "placement-0.30": lambda: placed("0.30", 0.30),
    "placement-0.33": lambda: placed("0.33", 0.33),
    "placement-adjacent": lambda: placed("two adjacent corners"),
    "placement-corner": lambda: placed("one corner"),
    "placement-wall": lambda: placed("one wall"),
    "alpha": lambda: " ".join(f"{CTarget(TRACK, 1.0, content).slope:.4f}" for content in (0.2, 0.3, 0.5, 0.8)),
    "c-target": lambda: f"{CTarget(TRACK, 1.25, 0.5).area_m2(AREA):.2f} m2",
    "content": lambda: inside(0.3),
    "p-r": lambda: f"{detection_probability(AREA, TRACK, [(5.25, 4.25)], 1.25)[0]:.4f}",
    "observation-cells": lambda: str(len(observation_cells(CELLS, CELLS.free([], 0.5), TRACK, 1.25, 0.3))),
    "sweep-2": lambda: swept(2.0),
    "sweep-4": lambda: swept(4.0),
    "stay": stay,
    "a-star": lambda: route((0.0, 0.0), (9.9, 9.9)),
    "a-star-obstacle": lambda: route((0.0, 0.0), (9.9, 9.9), OBSTACLE),
    "a-star-no-zone": lambda: route((8.0, 1.2), (8.0, 8.0)),
    "a-star-zone": lambda: route((8.0, 1.2), (8.0, 8.0), ZONE),
    "free-cells": lambda: f"{CELLS.free([OBSTACLE], 0.5).sum()}, {CELLS.free([OBSTACLE, ZONE], 0.5).sum()}",
    "line": exit_of_the_line,
    "missed": lambda: " ".join(f"{missed_share(1.0, SPEEDS[1], step):.2%}" for step in (0.1, 0.5, 1.0)),
}


@pytest.mark.parametrize("name", ROWS)
def test_the_page_says_what_the_code_gives(name):
    ours = ROWS[name]()
    print(f"{name}: {ours}")

    assert documented("Chapter 2")[name] == ours


def test_the_page_has_no_row_that_is_not_computed():
    assert set(documented("Chapter 2")) == set(ROWS)
