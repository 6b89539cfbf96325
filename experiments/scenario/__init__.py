"""Reads a scenario from a TOML file into one frozen object with all data of a run. Format: docs/scenario.md."""

from experiments.scenario.library import catalog, find
from experiments.scenario.loader import load
from experiments.scenario.model import AgentSpec, Bound, ImpairmentSpec, MediumSpec, PlantSpec, Scenario
from experiments.scenario.problems import ScenarioError

__all__ = ["AgentSpec", "Bound", "ImpairmentSpec", "MediumSpec", "PlantSpec", "Scenario", "ScenarioError", "catalog",
           "find", "load"]
