"""The triggering policy that a scenario names, with the gains of its team."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from agents.tracking.controller import Inputs, State, TrackingController
from agents.tracking.error_system import LIMITS, TrackingErrorSystem
from agents.tracking.optimal_preparation import POLICY, interval_tables
from agents.tracking.planned_gains import gains_of
from agents.triggering.policies import Policy
from agents.triggering.policies.table import PolicySettings, build_policy


def make_policy(team: Mapping[str, Any], name: str, settings: PolicySettings,
                controller: TrackingController | None = None) -> Policy[State, Inputs]:
    """Return the policy `name` with the gains of `gains_of`; ValueError if the name or a setting does not fit."""
    if name == POLICY:
        settings = replace(settings, tables=interval_tables(team))
    system = TrackingErrorSystem(controller or TrackingController(), limits=LIMITS)
    return build_policy(name, system, gains_of(team), settings)
