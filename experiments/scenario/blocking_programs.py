"""Tells ordinary blocking code (`firmware_sim/blocking`) from the programs of boards."""

from __future__ import annotations

from typing import Any, Literal

from experiments.programs.firmware_programs import class_for
from experiments.scenario.model import Scenario


def is_blocking(program: Any) -> bool:
    """Return whether a program is blocking code: any callable but a class, which is a board's program."""
    return not isinstance(program, type)


def repeating_host(scenario: Scenario) -> Literal["process", "inline"]:
    """Return the host for a campaign or a search, one process of which makes many runs.

    Inline is faster and a single run has the same result there. But blocking programs use libraries in ways that boards
    do not, and what a library keeps inside its objects (a cache, a counter of connections) outlives a run inline, see
    `experiments/run/shared_state.py`. With processes a run cannot depend on the runs before it, so its row is that of
    `marconet run`. `marconet campaign --host inline` is there for programs that leave nothing behind.
    """
    return "process" if blocks(scenario) else "inline"


def blocks(scenario: Scenario) -> bool:
    """Return whether an agent of the scenario runs blocking code."""
    return any(is_blocking(class_for(agent.program, scenario.folder)) for agent in scenario.agents.values())
