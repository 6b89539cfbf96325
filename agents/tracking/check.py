"""Problems of a tracking scenario, found before a run: one sentence each, with the remedy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from math import isfinite
from typing import Any

from agents.tracking.optimal_preparation import POLICY, optimal_problems
from agents.tracking.team_policy import make_policy
from agents.tracking.tracking_settings import TrackingSettings
from firmware_sim.scenario_view import Own, OwnAgent, ScenarioView

ROBOT = ("wheel_radius_m", "track_m", "counts_per_turn")


def companion_problems(scenario: ScenarioView, own: Own[TrackingSettings]) -> Iterator[str]:
    """Yield a problem for gains that certify no horizon, an unknown policy, missing wheel parameters, missing ports."""
    for name, agent in own.items():
        yield from _policy_problems(scenario, agent)
        yield from wheel_problems(scenario, name)
        yield from _missing_ports(name, agent, ("radio", "can"))


def _policy_problems(scenario: ScenarioView, agent: OwnAgent[TrackingSettings]) -> Iterator[str]:
    if agent.settings.policy == POLICY:             # its tables, which take seconds, are made before the run
        yield from optimal_problems(scenario)
        return
    try:
        make_policy(scenario.team, agent.settings.policy, agent.settings.policy_settings())
    except (ValueError, TypeError, KeyError) as error:
        yield f"agents.{agent.name}.parameters: {error}"


def wheel_problems(scenario: ScenarioView, name: str) -> Iterator[str]:
    """Yield a problem if the scenario does not tell robot `name` what it needs to know of its wheels."""
    if lacking := [key for key in ROBOT if key not in scenario.team.get("robot", {})]:
        yield f"team.robot: is missing {', '.join(lacking)}, which {name} needs to know of its wheels"


def reference_problems(scenario: ScenarioView, own: Own[Any]) -> Iterator[str]:
    """Yield a problem for a missing plant, missing or wrong instants of the inputs, a missing radio."""
    for name, agent in own.items():
        if not agent.has_plant:
            yield f"agents.{name}.plant: is missing; a reference robot drives one: {{ fmu = \"virtual_reference\" }}"
        table = scenario.team.get("reference")
        from_s = table.get("from_s") if isinstance(table, Mapping) else None
        if from_s is None:
            yield (f"team.reference.from_s: is missing: the instants at which {name} changes its inputs and says so; "
                   "write from_s, v_mps and omega_radps there and parameters_from = \"team.reference\" in its plant")
        elif not _later_and_later(from_s):
            yield f"team.reference.from_s={from_s}: expected a list of later and later instants [s]"
        yield from _missing_ports(name, agent, ("radio",))


def _missing_ports(name: str, agent: OwnAgent[Any], needed: Sequence[str]) -> Iterator[str]:
    if lacking := [port for port in needed if port not in agent.media]:
        yield (f"agents.{name}.media: lacks {', '.join(lacking)}; it has {', '.join(agent.media) or 'none'}, "
               f"and its program speaks on media of these names")


def _later_and_later(from_s: object) -> bool:
    """Return whether the entries of at least 0 ascend; pieces with a negative one are not in use."""
    if not isinstance(from_s, list) or not all(isinstance(each, int | float) and isfinite(each) for each in from_s):
        return False
    return all(one < next_one for one, next_one in pairwise(each for each in from_s if each >= 0))
