"""The ground on which the robots of a scenario act, as their programs declare it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from experiments.scenario.declarations import declared
from experiments.scenario.problems import Problems
from firmware_sim.ground_plan import GroundPlan, joined


def ground_of(programs: Mapping[type, Mapping[str, Any]], team: Mapping[str, Any],
              problems: Problems) -> GroundPlan | None:
    """Return the ground plans of all agents as one, None without any; add a problem for each declaration that fails.

    `programs` maps each class to the settings of its agents.
    """
    plans = dict.fromkeys(plan for _, plan in declared("ground_plan", GroundPlan, programs, team, problems))
    return joined(list(plans))
