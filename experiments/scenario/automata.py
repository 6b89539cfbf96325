"""The hybrid automata that the programs of a scenario declare, by agent.

    @staticmethod
    def automaton(settings, team) -> Automaton      settings: None without `Settings`; team: the table [team] as written

A class without this method has none. Programs record their changes of mode with `agents.hybrid.modes`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from agents.hybrid.automaton import Automaton
from experiments.programs.firmware_programs import class_for
from experiments.scenario.declarations import declared
from experiments.scenario.problems import Problems
from firmware_sim.program_settings import build_settings


class Runs(Protocol):
    @property
    def program(self) -> str: ...
    @property
    def parameters(self) -> dict[str, Any]: ...


def automata_of(agents: Mapping[str, Runs], team: Mapping[str, Any], folder: Path) -> dict[str, Automaton]:
    """Return the automaton of each agent whose program declares one; `folder` is that of the scenario."""
    found = {}
    for name, agent in agents.items():
        program = class_for(agent.program, folder)
        if (declare := getattr(program, "automaton", None)) is not None:
            found[name] = declare(build_settings(program, agent.parameters), team)
    return found


def declaring(programs: Mapping[type, Mapping[str, Any]]) -> list[str]:
    """Return the agents whose programs declare an automaton; `programs` maps each class to its agents."""
    return [name for cls, settings_of in programs.items() if hasattr(cls, "automaton") for name in settings_of]


def check_automata(programs: Mapping[type, Mapping[str, Any]], team: Mapping[str, Any],
                   problems: Problems) -> dict[str, tuple[str, ...]]:
    """Return the modes of each automaton, by agent, and add a problem for each declaration that fails.

    `programs` maps each class to the settings of its agents. Call it for a scenario in which the programs found no
    mistake: what they refuse may make a declaration fail.
    """
    return {name: tuple(found.modes) for name, found in declared("automaton", Automaton, programs, team, problems)}
