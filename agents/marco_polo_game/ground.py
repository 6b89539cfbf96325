"""The ground of a game for its report: the area, and the obstacles and zones of poor communication of `[team]`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from agents.marco_polo_game.game_table import game_of
from firmware_sim.ground_plan import GroundPlan, GroundShape

SHAPES: Final = (("obstacles", "obstacle", True), ("zones", "zone of poor communication", False))


def ground_of_game(team: Mapping[str, Any]) -> GroundPlan:
    """Return the ground that `[team]` describes; ValueError names what is wrong."""
    area = game_of(team).area
    shapes = [GroundShape(what, tuple((float(x), float(y)) for x, y in corners), solid)
              for key, what, solid in SHAPES for corners in team.get(key, ())]
    return GroundPlan(area.x_m, area.y_m, tuple(shapes))
