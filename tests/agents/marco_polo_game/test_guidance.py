"""Where a deployed sensor drives: pursuits among obstacles, investigations that stand or sweep."""

from __future__ import annotations

from itertools import pairwise
from math import dist
from types import SimpleNamespace
from typing import Any

import pytest
import shapely

from agents.marco_polo.cells import square
from agents.marco_polo.reward import Sensor, investigation_offer, pursuit_offer
from agents.marco_polo.track_line import fit_track
from agents.marco_polo_game.game_table import game_of
from agents.marco_polo_game.guidance import Deck, Deployment
from agents.marco_polo_game.investigation import Investigation
from agents.marco_polo_game.plain_pursuit import PlainPursuit
from agents.marco_polo_game.track import Seen, Track
from agents.pursuit import Place

S, MS = 1_000_000_000, 1_000_000
BOX = [[4.0, 4.0], [5.0, 4.0], [5.0, 6.0], [4.0, 6.0]]


def deck(**game: Any) -> Deck:
    obstacles = game.pop("obstacles", [])
    found = game_of({"sensors": ["ugv", "uav"], "targets": ["t"], "ugvs": ["ugv"], "area_x_m": [0.0, 10.0],
                     "area_y_m": [0.0, 10.0], "radius_m": {"ugv": 1.0, "uav": 1.5}, "game": game,
                     "obstacles": obstacles})
    ground = found.ground(ugv=True)
    board: Any = SimpleNamespace(name="ugv", event=lambda *told: None)
    return Deck(board, SimpleNamespace(exposure_ns=100 * MS), found, ground, ground.graph)


def track(on: Deck, *seen: tuple[str, int, float, float]) -> Track:
    found = Track(on.game.area, on.game.parameters)
    for sensor, at_ns, x, y in seen:
        found.detected(sensor, Seen(at_ns, (x, y)))
    return found


def deployed(on: Deck, target: Track, own: Place, investigates: bool = False) -> Deployment:
    sensor, k = Sensor(own, 1.0, [(1.0, 9.0)], [1.5]), 3
    line = target.forecast().track
    offer = (investigation_offer(sensor, on.graph(), line, k, 0.3) if investigates
             else pursuit_offer(sensor, on.graph(), line, line.last, k))
    assert offer is not None
    return Deployment(0, target, offer, own)


def crosses(start: Place, way: Any) -> bool:
    """Whether the platform overlaps the box on the way, by squares every cm."""
    box = shapely.Polygon(BOX).buffer(-1e-6)
    for (x, y), (u, v) in pairwise([start, *way]):
        steps = 1 + int(dist((x, y), (u, v)) / 0.01)
        places = [(x + (u - x) * k / steps, y + (v - y) * k / steps) for k in range(steps + 1)]
        if shapely.intersects(shapely.polygons([square(place, 0.5) for place in places]), box).any():
            return True
    return False


@pytest.mark.parametrize("obstacles", [[], [BOX]], ids=["free", "a box in the way"])
def test_in_view_a_pursuer_drives_straight_if_the_way_is_clear(obstacles: Any) -> None:
    on = deck(obstacles=obstacles)
    target = track(on, ("a", 0, 8.0, 9.0), ("b", 4 * S, 7.0, 7.0), ("c", 8 * S, 6.5, 5.5))
    target.sight = Seen(8 * S, (6.5, 5.5))
    own, pursuit = (2.25, 5.25), PlainPursuit(on)
    pursuit.begin(deployed(on, target, own), 8 * S)

    plan = pursuit.plan(own, 8 * S)

    assert plan is not None
    assert len(plan.way) == 1 or obstacles
    assert not obstacles or not crosses(own, plan.way)
    assert crosses(own, [target.forecast().intercept(own, 1.2, 8 * S)])
    assert plan.again_ns == 9 * S


def test_out_of_view_it_drives_by_cells_and_gives_up_where_the_target_should_have_left() -> None:
    on = deck()
    target = track(on, ("a", 0, 1.0, 5.0), ("b", 4 * S, 3.0, 5.0))          # 0.5 m/s to the right: leaves at 18 s
    pursuit = PlainPursuit(on)
    pursuit.begin(deployed(on, target, (5.25, 5.25)), 5 * S)

    assert pursuit.ends_ns == 18 * S
    plan = pursuit.plan((5.25, 5.25), 5 * S)
    assert plan is not None
    assert all(on.ground.cells.centroid(on.ground.cells.cell_at(place)) == place for place in plan.way)
    assert pursuit.plan((1.0, 1.0), 18 * S) is not None                     # not yet there
    assert pursuit.plan((9.75, 5.25), 18 * S - 1) is not None               # not yet then
    assert pursuit.plan((9.75, 5.25), 18 * S) is None


@pytest.mark.parametrize("obstacles", [[], [BOX]], ids=["free", "among obstacles"])
@pytest.mark.parametrize("sweeps", [False, True])
def test_an_investigation_stands_in_its_cell_or_sweeps_across_the_bisector(sweeps: bool, obstacles: Any) -> None:
    on = deck(sweeps=sweeps, obstacles=obstacles)
    target = track(on, ("a", 0, 1.0, 5.0), ("b", 4 * S, 3.0, 5.0))
    own, investigation = (6.25, 8.25), Investigation(on)
    deployment = deployed(on, target, own, investigates=True)
    investigation.begin(deployment, 5 * S)

    plan = investigation.plan(own, 5 * S)

    assert plan is not None
    assert plan.again_ns == investigation.ends_ns
    assert investigation.plan(own, investigation.ends_ns) is None
    assert not crosses(own, plan.way[:20]) or not obstacles
    if not sweeps:
        assert plan.way[-1] == on.ground.cells.centroid(deployment.offer.goal)
        return
    track_y = fit_track([(1.0, 5.0), (3.0, 5.0)]).last[1]
    right, left = plan.way[-2:]
    assert right[0] == pytest.approx(left[0])                               # orthogonal to the bisector, y = 5
    assert (right[1] - track_y) * (left[1] - track_y) <= 0.0
    assert dist(right, left) > 0.5
    lasts_s = (investigation.ends_ns - 5 * S) * 1e-9
    assert sum(dist(*leg) for leg in pairwise(plan.way)) >= 1.2 * lasts_s - 5.0     # it moves until the end
