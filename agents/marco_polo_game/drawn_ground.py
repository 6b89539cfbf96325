"""The ground of a game as its report draws it: the area, obstacles, and zones of poor communication."""

from __future__ import annotations

from agents.marco_polo_game.game_table import Game
from firmware_sim.ground_plan import GroundPlan, GroundShape


def drawn_ground(game: Game) -> GroundPlan:
    shapes = [*(GroundShape("obstacle", tuple(corners)) for corners in game.obstacles),
              *(GroundShape("zone of poor communication", tuple(corners), solid=False) for corners in game.zones)]
    return GroundPlan(game.area.x_m, game.area.y_m, tuple(shapes))
