"""The gains gamma_n of a team: those of its table `[team.gains]`, or those of section 4.6."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from agents.tracking.section_4_6 import GAINS
from agents.triggering.gain_table import GainTable, RegionalGain


def gains_of(team: Mapping[str, Any]) -> GainTable:
    """Return the gains of the team's table, or those of section 4.6 if it has none."""
    if "gains" not in team:
        return GAINS
    table = team["gains"]
    return GainTable({(float(v), float(omega)): float(gain) for v, omega, gain in table["planned"]},
                     float(table["unified"]),
                     regional={(float(v), float(omega)): RegionalGain(float(gain), float(radius))
                               for v, omega, gain, radius in table.get("regional", [])})
