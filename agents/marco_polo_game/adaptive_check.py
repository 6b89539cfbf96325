"""Problems of a scenario with adaptive pursuits, beside those of any game: each with the value that would do."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from agents.marco_polo_game.adaptive_settings import AdaptiveSettings
from agents.marco_polo_game.game_table import game_of
from agents.marco_polo_game.sensor_check import game_problems
from firmware_sim.scenario_view import MediumView, Own, ScenarioView


def adaptive_problems(scenario: ScenarioView, own: Own[Any], captures: bool) -> Iterator[str]:
    """Yield the reasons why these sensors cannot play; `captures`: they are UGVs, which pursue."""
    known = list(game_problems(scenario, own, captures))
    yield from known
    if known:
        return
    game = game_of(scenario.team)
    for name, agent in own.items():
        yield from _view_problems(scenario.media[agent.settings.view], name, agent.settings)
        if captures:
            try:
                agent.settings.pursuer(game, name)
            except ValueError as error:
                yield from str(error).splitlines()


def _view_problems(view: MediumView, name: str, settings: AdaptiveSettings) -> Iterator[str]:
    camera, place = view.settings.camera(name), f"agents.{name}.parameters"
    if camera.latency_ns != settings.exposure_latency_ns:
        yield (f"{place}.exposure_latency_ns={settings.exposure_latency_ns}: media.{view.name} has "
               f"latency_ns={camera.latency_ns}; take the same")
    if camera.noise_m > settings.sigma_m:
        yield (f"{place}.sigma_m={settings.sigma_m}: media.{view.name} has noise_m={camera.noise_m}; take as much or "
               f"more")
    if name in view.settings.floor_plan().unasked:
        yield (f"media.{view.name}.every_exposure_to: {name} gets every exposure, and its program asks for those that "
               f"it needs; leave it out")
