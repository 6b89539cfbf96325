"""The table `[team]` of a game: who takes part, the area, and the constants that all programs share.

    sensors, targets    names; a number in a frame is a place in these lists
    ugvs                those of the sensors that capture; the others are UAVs, which fly over platforms
    radius_m            radius of each sensor's field of view, by name
    area_x_m, area_y_m  from, to
    obstacles           convex polygons, lists of corners [x, y] in m: walls and boxes
    zones               the same, of areas with poor communication; targets may enter them
    game                fields of `GameParameters` and, in its tables of weights, of `RewardWeights`; all have
                        defaults, times are in ns
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from math import isfinite
from typing import Any, Final, TypeVar

from agents.bidding.bidding import sensors_of
from agents.marco_polo.cells import Cells, Polygon
from agents.marco_polo.checks import check_entrances, check_obstacles
from agents.marco_polo.game_parameters import GameParameters
from agents.marco_polo.ground import Ground
from agents.marco_polo.reward import RewardWeights
from agents.pursuit.law import Area

MOST_TARGETS = 255
DEFAULTS: Final = GameParameters()
Table = TypeVar("Table", GameParameters, RewardWeights)


@dataclass(frozen=True)
class Game:
    sensors: tuple[str, ...]
    targets: tuple[str, ...]
    ugvs: frozenset[str]
    radius_m: Mapping[str, float]
    area: Area
    parameters: GameParameters
    obstacles: tuple[Polygon, ...] = ()
    zones: tuple[Polygon, ...] = ()

    def speed_mps(self, sensor: str) -> float:
        """Return the greatest speed of a sensor."""
        return self.parameters.ugv_mps if sensor in self.ugvs else self.parameters.uav_mps

    def barriers(self, ugv: bool) -> list[Polygon]:
        """Return what a sensor does not drive through: UAVs fly over obstacles, zones are virtual ones for both."""
        return [*(self.obstacles if ugv else ()), *(self.zones if self.parameters.zones_are_obstacles else ())]

    def ground(self, ugv: bool) -> Ground:
        """Return where the platform of a UGV, or of a UAV, can drive."""
        return Ground(Cells(self.area, self.parameters.cell_m), self.barriers(ugv), self.parameters.platform_m)


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
        if not (_is_number(radius) and isfinite(radius) and radius > 0):
            raise ValueError(f"team.radius_m.{name}={radius}: expected a number above 0, in m")
    parameters = _changed(DEFAULTS, team.get("game", {}), "team.game")
    area, obstacles, zones = _area(team), _polygons(team, "obstacles"), _polygons(team, "zones")
    check_obstacles(obstacles, area, "team.obstacles")
    check_obstacles(zones, area, "team.zones")
    check_entrances(area, obstacles, "team.obstacles")
    return Game(sensors, targets, frozenset(ugvs), dict(radius_m), area, parameters, obstacles, zones)


def _changed(defaults: Table, table: Any, place: str) -> Table:
    """Return `defaults` with the values of `table` in place of theirs; ValueError for other keys, types or values."""
    keys = {field.name for field in fields(defaults)}
    if not isinstance(table, Mapping) or (unknown := sorted(table.keys() - keys)):
        told = f": {', '.join(unknown)}" if isinstance(table, Mapping) else f"={table}"
        raise ValueError(f"{place}{told}: expected keys among {', '.join(sorted(keys))}")
    values = {key: _value(getattr(defaults, key), given, f"{place}.{key}") for key, given in table.items()}
    try:
        return replace(defaults, **values)
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from None


def _value(default: Any, given: Any, place: str) -> Any:
    """Return a value of the type of `default`; ValueError if `given` is none."""
    match default:
        case RewardWeights():
            return _changed(default, given, place)
        case bool():
            fits, expected = isinstance(given, bool), "true or false"
        case int():
            fits, expected = isinstance(given, int) and not isinstance(given, bool), "a whole number"
        case _:
            fits, expected = _is_number(given), "a number"
    if not fits:
        raise ValueError(f"{place}={given}: expected {expected}")
    return given


def _is_number(found: Any) -> bool:
    return isinstance(found, int | float) and not isinstance(found, bool)


def _names(team: Mapping[str, Any], key: str) -> tuple[str, ...]:
    found = team.get(key)
    if not isinstance(found, Sequence) or isinstance(found, str) or not all(
            isinstance(name, str) for name in found) or len(set(found)) < len(found):
        raise ValueError(f"team.{key}={found}: expected a list of names, each once")
    return tuple(found)


def _polygons(team: Mapping[str, Any], key: str) -> tuple[Polygon, ...]:
    found = team.get(key, ())
    if not isinstance(found, Sequence) or isinstance(found, str):
        raise ValueError(f"team.{key}={found}: expected a list of polygons, each a list of corners [x, y]")
    for number, corners in enumerate(found):
        if not isinstance(corners, Sequence) or not all(
                isinstance(corner, Sequence) and len(corner) == 2
                and all(_is_number(value) for value in corner) for corner in corners):
            raise ValueError(f"team.{key}[{number}]={corners}: expected a list of corners [x, y], in m")
    return tuple(tuple((float(x), float(y)) for x, y in corners) for corners in found)


def _area(team: Mapping[str, Any]) -> Area:
    sides = []
    for key in ("area_x_m", "area_y_m"):
        found = team.get(key)
        if not isinstance(found, Sequence) or len(found) != 2 or not all(map(_is_number, found)):
            raise ValueError(f"team.{key}={found}: expected [from, to], in m")
        sides.append((float(found[0]), float(found[1])))
    try:
        return Area(*sides)
    except ValueError as error:
        raise ValueError(f"team: area {error}") from None
