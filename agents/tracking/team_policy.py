"""The triggering policy that a scenario names, with the gains of its team."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from agents.tracking.controller import Inputs, State, TrackingController
from agents.tracking.error_system import LIMITS, TrackingErrorSystem
from agents.tracking.section_4_6 import GAINS
from agents.triggering.gain_table import GainTable, RegionalGain
from agents.triggering.policies import Policy
from agents.triggering.policies.table import PolicySettings, build_policy


def make_policy(team: Mapping[str, Any], name: str, settings: PolicySettings,
                controller: TrackingController | None = None) -> Policy[State, Inputs]:
    """Return the policy `name` with the gains of `gains_of`; ValueError if the name or a setting does not fit."""
    system = TrackingErrorSystem(controller or TrackingController(), limits=LIMITS)
    return build_policy(name, system, gains_of(team), settings)


def gains_of(team: Mapping[str, Any]) -> GainTable:
    """Return the gains of the team's table, or those of section 4.6 if it has none."""
    if "gains" not in team:
        return GAINS
    table = team["gains"]
    return GainTable({(float(v), float(omega)): float(gain) for v, omega, gain in table["planned"]},
                     float(table["unified"]),
                     regional={(float(v), float(omega)): RegionalGain(float(gain), float(radius))
                               for v, omega, gain, radius in table.get("regional", [])})

