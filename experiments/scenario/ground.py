"""The ground on which the robots of a scenario act, as their programs declare it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from experiments.scenario.problems import Problems
from firmware_sim.ground_plan import GroundPlan, joined


def ground_of(programs: Mapping[type, Mapping[str, Any]], team: Mapping[str, Any],
              problems: Problems) -> GroundPlan | None:
    """Return the ground plans of all agents as one, None without any; add a problem for each declaration that fails.

    `programs` maps each class to the settings of its agents.
    """
    plans: dict[GroundPlan, None] = {}
    for cls, settings_of in programs.items():
        if (declare := getattr(cls, "ground_plan", None)) is None:
            continue
        for name, settings in settings_of.items():
            try:
                found = declare(settings, team)
            except Exception as error:
                problems.say(f"agents.{name}: {cls.__name__}.ground_plan failed: {type(error).__name__}: {error}")
                continue
            if isinstance(found, GroundPlan):
                plans[found] = None
            else:
                problems.say(f"agents.{name}: {cls.__name__}.ground_plan returned {type(found).__name__}: expected "
                             "a GroundPlan")
    return joined(list(plans))
