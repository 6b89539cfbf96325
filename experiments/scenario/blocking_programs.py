"""Which agents of a scenario run ordinary blocking code (`firmware_sim/blocking`), and that these need processes."""

from __future__ import annotations

from typing import Any

from experiments.scenario.model import Scenario
from experiments.scenario.own_modules import class_for


class NeedsProcess(ValueError):
    """A program that cannot run beside others in one process."""

    exit_code = 2


def is_blocking(program: Any) -> bool:
    """A class is a board's program, whatever else can be called is blocking code."""
    return not isinstance(program, type)


def refuse_blocking(scenario: Scenario) -> None:
    """Raise `NeedsProcess` for the first agent whose program is blocking code."""
    for agent in scenario.agents.values():
        if is_blocking(class_for(agent.program, scenario.folder)):
            raise NeedsProcess(f"{scenario.name}: agents.{agent.name}: {agent.program} is blocking code, which needs a "
                               "process of its own, as the standard library's time is replaced there: run it with "
                               "--host process")
