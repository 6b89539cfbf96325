"""Finds robots that a medium takes to stand still while their plants move them: two truths of one position.

A plant moves its robot if a medium reads its position as a pose, or if it has outputs `x` and `y` in metres.
"""

from __future__ import annotations

from collections.abc import Iterator

from experiments.scenario.model import AgentSpec, Scenario
from experiments.scenario.plant_parameters import plant_names


def standing_robots(scenario: Scenario) -> list[str]:
    """Return a warning for each medium and robot that it takes to stand still although its plant moves it."""
    return [warning for medium in scenario.media.values()
            for node in medium.settings.standing(medium.nodes) if node in scenario.agents
            for warning in _warnings(scenario, medium.name, scenario.agents[node])]


def _warnings(scenario: Scenario, medium: str, agent: AgentSpec) -> Iterator[str]:
    outputs = _moving_outputs(scenario, agent)
    if outputs:
        key = ".".join(("media", medium, *scenario.media[medium].settings.poses_key))
        names = ", ".join(f'"{name}"' for name in outputs)
        yield (f"media.{medium}: {agent.name} stands at its at_m for the whole run, but its plant moves it "
               f"({', '.join(outputs)}): write {key} = {{ {agent.name} = [{names}] }}, and the links follow it")


def _moving_outputs(scenario: Scenario, agent: AgentSpec) -> tuple[str, ...]:
    """Return the outputs of the agent's plant with its position, none if it has none."""
    if agent.plant is None:
        return ()
    names = plant_names(agent.plant.fmu, scenario.folder)
    found = tuple(name for name in ("x", "y", "z") if name in names.outputs and names.variables[name].unit == "m")
    if found[:2] == ("x", "y"):
        return found
    poses = [medium.settings.poses().get(agent.name) for medium in scenario.media.values()]
    return next((pose.outputs[:2] for pose in poses if pose is not None), ())
