"""The table `[team]` of a game: who takes part, the area, and the constants that all programs share.

    sensors, targets    names; a number in a frame is a place in these lists
    ugvs                those of the sensors that capture; the others are UAVs, which fly over platforms
    radius_m            radius of each sensor's field of view, by name
    area_x_m, area_y_m  from, to
    game                fields of `GameParameters`; all have defaults, times are in ns
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from math import isfinite
from typing import Any

from agents.bidding.bidding import sensors_of
from agents.marco_polo.game_parameters import GameParameters
from agents.marco_polo.reward import RewardWeights
from agents.pursuit.law import Area

MOST_TARGETS = 255
WEIGHTS = ("investigation", "pursuit")          # keys that are tables of weights
KEYS = frozenset(field.name for field in fields(GameParameters))


@dataclass(frozen=True)
class Game:
    sensors: tuple[str, ...]
    targets: tuple[str, ...]
    ugvs: frozenset[str]
    radius_m: Mapping[str, float]
    area: Area
    parameters: GameParameters

    def speed_mps(self, sensor: str) -> float:
        """Return the greatest speed of a sensor."""
        return self.parameters.ugv_mps if sensor in self.ugvs else self.parameters.uav_mps


def game_of(team: Mapping[str, Any]) -> Game:
    """Return the game that `[team]` describes; ValueError names the key, its value and what is expected."""
    sensors = sensors_of(team)
    targets = _names(team, "targets")
    if len(targets) > MOST_TARGETS:
        raise ValueError(f"team.targets: {len(targets)} names: a frame numbers up to {MOST_TARGETS}")
    ugvs = _names(team, "ugvs")
    if unknown := [name for name in ugvs if name not in sensors]:
        raise ValueError(f"team.ugvs: {', '.join(unknown)}: expected names of team.sensors, {', '.join(sensors)}")
    radius_m = team.get("radius_m")
    if not isinstance(radius_m, Mapping) or set(radius_m) != set(sensors):
        raise ValueError(f"team.radius_m={radius_m}: expected one radius for each of {', '.join(sensors)}")
    for name, radius in radius_m.items():
        if not (isinstance(radius, int | float) and isfinite(radius) and radius > 0):
            raise ValueError(f"team.radius_m.{name}={radius}: expected more than 0")
    table = team.get("game", {})
    if not isinstance(table, Mapping) or (unknown := sorted(table.keys() - KEYS)):
        raise ValueError(f"team.game: {', '.join(unknown) if isinstance(table, Mapping) else table}: expected keys "
                         f"among {', '.join(sorted(KEYS))}")
    try:
        weights = {name: RewardWeights(**table[name]) for name in WEIGHTS if name in table}
        parameters = GameParameters(**{**table, **weights})
    except (TypeError, ValueError) as error:
        raise ValueError(f"team.game: {error}") from None
    return Game(sensors, targets, frozenset(ugvs), dict(radius_m), _area(team), parameters)


def _names(team: Mapping[str, Any], key: str) -> tuple[str, ...]:
    found = team.get(key)
    if not isinstance(found, Sequence) or isinstance(found, str) or len(set(found)) < len(found):
        raise ValueError(f"team.{key}={found}: expected a list of names, each once")
    return tuple(found)


def _area(team: Mapping[str, Any]) -> Area:
    sides = []
    for key in ("area_x_m", "area_y_m"):
        found = team.get(key)
        if not isinstance(found, Sequence) or len(found) != 2:
            raise ValueError(f"team.{key}={found}: expected [from, to]")
        sides.append((float(found[0]), float(found[1])))
    try:
        return Area(*sides)
    except ValueError as error:
        raise ValueError(f"team: area {error}") from None
