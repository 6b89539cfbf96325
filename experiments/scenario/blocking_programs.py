"""Refuses the host `inline` for agents that run ordinary blocking code (`firmware_sim/blocking`)."""

from __future__ import annotations

from typing import Any

from experiments.scenario.model import Scenario
from experiments.scenario.own_modules import class_for


class NeedsProcess(ValueError):
    """A program cannot run in one process with others."""

    exit_code = 2


def is_blocking(program: Any) -> bool:
    """Return whether a program is blocking code: any callable but a class, which is a board's program."""
    return not isinstance(program, type)


def blocks(scenario: Scenario) -> bool:
    """Return whether an agent of the scenario runs blocking code."""
    return any(is_blocking(class_for(agent.program, scenario.folder)) for agent in scenario.agents.values())


def refuse_blocking(scenario: Scenario) -> None:
    """Raise `NeedsProcess` for the first agent whose program is blocking code."""
    for agent in scenario.agents.values():
        if is_blocking(class_for(agent.program, scenario.folder)):
            raise NeedsProcess(f"{scenario.name}: agents.{agent.name}: {agent.program} is blocking code, which needs a "
                               "process of its own, as the standard library's time is replaced there: run it with "
                               "--host process")
