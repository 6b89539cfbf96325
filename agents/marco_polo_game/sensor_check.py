"""Problems of a scenario of the Marco Polo game, found before a run: each with the number that would do."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from agents.bidding.bidding_check import bidding_problems
from agents.marco_polo.cells import Cells
from agents.marco_polo.checks import check_area_coverage, check_detections, check_exits, check_pursuers, check_starts
from agents.marco_polo_game.game_table import Game, game_of
from agents.marco_polo_game.movers import Platform
from agents.marco_polo_game.sensor_settings import SensorSettings
from agents.marco_polo_game.zone_check import zone_problems
from firmware_sim.scenario_view import Own, OwnAgent, ScenarioView
from netem.media.answers import Camera


def game_problems(scenario: ScenarioView, own: Own[Any], captures: bool) -> Iterator[str]:
    """Yield the reasons why these sensors cannot play; `captures`: they are UGVs."""
    yield from bidding_problems(scenario, own)
    try:
        game = game_of(scenario.team)
        check_pursuers(len(game.ugvs), "team.ugvs")
        check_detections(game.parameters.detections, len(game.sensors), "team.game.detections")
        check_area_coverage(game.area, [game.radius_m[name] for name in game.sensors],
                            game.parameters.least_area_coverage, "team.game.least_area_coverage")
        _check_layout(scenario, game)
    except ValueError as error:
        yield str(error)
        return
    if (radio := scenario.media.get(next(iter(own.values())).settings.radio)) is not None:
        yield from zone_problems(game, radio)
    for name, agent in own.items():
        if (name in game.ugvs) is not captures:
            yield (f"agents.{name}: runs the program of a UGV and is missing in team.ugvs={sorted(game.ugvs)}"
                   if captures else f"team.ugvs={sorted(game.ugvs)}: {name} runs the program of a UAV")
        elif name in game.sensors:
            yield from _sensor_problems(scenario, game, name, agent)


def _check_layout(scenario: ScenarioView, game: Game) -> None:
    """Refuse starts in obstacles and zones, and exits that no UGV reaches."""
    try:
        cells, platform_m = Cells(game.area, game.parameters.cell_m), game.parameters.platform_m
    except ValueError as error:
        raise ValueError(f"team.game.{error}") from None
    starts = {name: (float(given.get("x", 0.0)), float(given.get("y", 0.0))) for name in game.sensors
              if name in scenario.agents and (plant := scenario.agents[name].plant) is not None
              for given in [plant.parameters]}
    check_starts(cells, starts, game.obstacles, game.zones, platform_m, frozenset(starts.keys() - game.ugvs), "agents")
    ugvs = {name: starts[name] for name in game.ugvs if name in starts}     # those that move a plant of their own
    if ugvs and (barriers := game.barriers(ugv=True)):
        check_exits(cells, ugvs, barriers, (), platform_m,
                    "team.obstacles" if len(barriers) == len(game.obstacles) else "team.obstacles, team.zones")


def _sensor_problems(scenario: ScenarioView, game: Game, name: str, agent: OwnAgent[SensorSettings]) -> Iterator[str]:
    settings = agent.settings
    needed = [settings.view, *([settings.grip] if name in game.ugvs else [])]
    if absent := [medium for medium in needed if medium not in agent.media]:
        yield f"agents.{name}.media: lacks {', '.join(absent)}; it has {', '.join(agent.media) or 'none'}"
        return
    view = scenario.media.get(settings.view)
    camera: Camera | None = view.settings.camera(name) if view is not None and view.settings else None
    if camera is None:
        yield f"agents.{name}.parameters.view={settings.view!r}: expected a medium of kind sensing"
        return
    yield from settings.platform.problems(scenario, Platform(
        name, agent.agent, camera.carrier, settings.view, game.speed_mps(name),
        barriers=bool(game.barriers(name in game.ugvs))))
    if camera.period_ns != settings.exposure_ns:
        yield (f"agents.{name}.parameters.exposure_ns={settings.exposure_ns}: media.{settings.view} has exposures "
               f"every {camera.period_ns} ns; take the same")
    if camera.view.range_m != game.radius_m[name]:
        yield (f"team.radius_m.{name}={game.radius_m[name]}: media.{settings.view} has range_m="
               f"{camera.view.range_m}; take the same")
