"""Scenarios: a TOML file in, one frozen object out that holds everything a run needs. Format: docs/scenario.md."""

from experiments.scenario.library import catalog, find
from experiments.scenario.loader import load
from experiments.scenario.model import AgentSpec, Bound, ImpairmentSpec, MediumSpec, PlantSpec, Scenario
from experiments.scenario.problems import ScenarioError

__all__ = ["AgentSpec", "Bound", "ImpairmentSpec", "MediumSpec", "PlantSpec", "Scenario", "ScenarioError", "catalog",
           "find", "load"]
