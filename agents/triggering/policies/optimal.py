"""Optimal self-triggering (Chapter 5): tau* from a table, made before the run, for the inputs measured now.

The decision is valid until the cap of tau*: a horizon certified by a gain, or the exact local limit. As kappa / cap
stands for the gain of such a decision, its gain product grows linearly with the age and is kappa at the cap. For inputs
without a table the trigger decides, as in `IndividualGains`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Generic

from agents.triggering.gain_table import SAME_INPUTS
from agents.triggering.policies import Decision
from agents.triggering.policies.input_output import IndividualGains, W, X
from agents.triggering.policies.interval_table import IntervalTable


class Optimal(Generic[X, W]):
    watch_ns = 0

    def __init__(self, tables: Mapping[tuple[float, ...], IntervalTable] | None,
                 trigger: IndividualGains[X, W]) -> None:
        if not tables:
            raise ValueError("policy='optimal': has no table of intervals; `agents.tracking.optimal_tables` makes them")
        self._tables, self._trigger = dict(tables), trigger
        self.last: Decision | None = None

    def decide(self, measured_ns: int, x: X, inputs: W) -> Decision:
        table = self._tables.get(inputs)
        if table is None and (table := self._nearly(inputs)) is None:
            self.last = self._trigger.decide(measured_ns, x, inputs)
            return self.last
        tau_s, cap_s, clamped = table.look_up(x)        # type: ignore[arg-type]
        self.last = Decision(measured_ns, max(int(tau_s * 1e9), 1), max(int(cap_s * 1e9), 1),
                             self._trigger.kappa / cap_s, 0.0, clamped=clamped)
        return self.last

    def look(self, now_ns: int, x: X) -> Decision:
        assert self.last is not None, "look before decide"
        return self.last

    def _nearly(self, inputs: W) -> IntervalTable | None:
        """Return the table of inputs that rounding has changed."""
        for planned, table in self._tables.items():
            if all(abs(a - b) <= SAME_INPUTS for a, b in zip(planned, inputs, strict=True)):
                return table
        return None
