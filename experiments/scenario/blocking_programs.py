"""Tells ordinary blocking code (`firmware_sim/blocking`) from the programs of boards."""

from __future__ import annotations

from typing import Any

from experiments.scenario.model import Scenario
from experiments.scenario.own_modules import class_for


def is_blocking(program: Any) -> bool:
    """Return whether a program is blocking code: any callable but a class, which is a board's program."""
    return not isinstance(program, type)


def blocks(scenario: Scenario) -> bool:
    """Return whether an agent of the scenario runs blocking code."""
    return any(is_blocking(class_for(agent.program, scenario.folder)) for agent in scenario.agents.values())
