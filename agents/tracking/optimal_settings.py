"""The table `[team.optimal]` of a scenario: what the optimal policy of its tracking robots minimizes, and over what.

S, the cost of a look, is the energy that both radios draw for request and answer: their airtimes times transmit_w at
the sender and receive_w at the receiver. So q, r and S are in watts and joules, and the trade is one of energy.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from math import isfinite, pi
from typing import Any, Literal

import msgspec

from agents.team_table import mistakes


class OptimalSettings(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    cap: Literal["local", "regional", "printed"] = "local"
    formulation: Literal["average_cost", "per_second", "per_transmission"] = "average_cost"
    shortest_ms: float = 5.0                # tau_floor
    look_cost_j: float | None = None        # S; None: from the airtimes and the two powers below
    transmit_w: float = 0.0
    receive_w: float = 0.0
    q_w_per_m2: float = 0.1                 # Q = q I3, also per rad^2
    r_w_s2_per_m2: float = 0.1              # R = r I2, also per (rad/s)^2
    measurement_noise: float = 0.15         # nu
    disturbance: float = 0.3                # e_omega
    x_m: tuple[float, ...] = (0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 7.0, 15.0)    # grid of |x1| and |x2|, besides 0
    heading_rad: tuple[float, ...] = (0.15, 0.3, 0.6, 1.2, pi)            # grid of |x3|, besides 0
    constant_ms: float = 0.0                # above 0: one interval for all states instead of tau*, to compare with
    observer: Literal["none", "particle", "unscented"] = "none"     # of x^, which replaces y^ in u and tau*
    candidates: int = 12                    # intervals compared at each state, from the shortest to the cap


def read_optimal(team: Mapping[str, Any]) -> OptimalSettings:
    """Return the settings; ValueError with all mistakes in one line."""
    table = team.get("optimal", {})
    if not isinstance(table, Mapping):
        raise ValueError(f"team.optimal={table!r}: expected a table")
    found = list(mistakes(table, OptimalSettings, "team.optimal"))
    if found:
        raise ValueError("; ".join(found))
    settings = msgspec.convert(dict(table), OptimalSettings)
    for name in ("shortest_ms", "q_w_per_m2", "r_w_s2_per_m2"):
        if not getattr(settings, name) > 0:
            found.append(f"team.optimal.{name}={getattr(settings, name):g}: expected more than 0")
    for name in ("look_cost_j", "transmit_w", "receive_w", "measurement_noise", "disturbance", "constant_ms"):
        value = getattr(settings, name)
        if value is not None and not (isfinite(value) and value >= 0):
            found.append(f"team.optimal.{name}={value:g}: expected 0 or more")
    for name in ("x_m", "heading_rad"):
        values = getattr(settings, name)
        if not values or values[0] <= 0 or any(a >= b for a, b in pairwise(values)):
            found.append(f"team.optimal.{name}={values}: expected ascending numbers above 0")
    if not 2 <= settings.candidates <= 64:
        found.append(f"team.optimal.candidates={settings.candidates}: expected 2 to 64")
    if found:
        raise ValueError("; ".join(found))
    return settings
