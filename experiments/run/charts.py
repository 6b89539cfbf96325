"""Asks the program classes of a scenario for the charts that its report draws of what they made before the run."""

from __future__ import annotations

from experiments.programs.firmware_programs import class_for
from experiments.run.node_specifications import own_agents
from experiments.scenario.model import Scenario
from experiments.scenario.problems import ScenarioError
from firmware_sim.height_chart import HeightChart


def charts_of(scenario: Scenario) -> list[HeightChart]:
    """Return the charts of all classes that have some, in the order of their paths."""
    found: list[HeightChart] = []
    for path in sorted({agent.program for agent in scenario.agents.values()}):
        program = class_for(path, scenario.folder)
        if (charts := getattr(program, "charts", None)) is None:
            continue
        for chart in charts(scenario, own_agents(scenario, path, program)):
            if not isinstance(chart, HeightChart):
                raise ScenarioError([f"{scenario.name}: {path}: charts returned {type(chart).__name__}: expected "
                                     "HeightChart"])
            found.append(chart)
    return found
