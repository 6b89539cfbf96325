"""The triggering policy that a scenario names, with the gains of its team."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from agents.tracking.controller import Inputs, State
from agents.tracking.error_system import LIMITS, TrackingErrorSystem
from agents.tracking.optimal_preparation import POLICY, interval_tables
from agents.tracking.planned_gains import gains_of
from agents.triggering.policies import Policy
from agents.triggering.policies.table import POLICIES, PolicySettings, build_policy


def make_policy(team: Mapping[str, Any], name: str, settings: PolicySettings) -> Policy[State, Inputs]:
    """Return the policy `name` with the gains of `gains_of`; ValueError if the name or a setting does not fit."""
    known = [policy for policy, kind in POLICIES.items() if kind.measurable]
    if name not in known:
        raise ValueError(f"policy={name!r}: expected one of {', '.join(known)}; others need to see the reference all "
                         "the time, which costs a transmission here")
    if name == POLICY:
        settings = replace(settings, tables=interval_tables(team))
    return build_policy(name, TrackingErrorSystem(limits=LIMITS), gains_of(team), settings)
