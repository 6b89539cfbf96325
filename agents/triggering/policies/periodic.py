"""Periodic measurements, at the shortest interval that any state within a radius requires."""

from __future__ import annotations

from typing import Generic

from agents.triggering.error_gain import horizon_s
from agents.triggering.policies import Decision
from agents.triggering.policies.input_output import IndividualGains, W, X


class Periodic(Generic[X, W]):
    """Certified while |x| <= radius (Remark 4); `period_ns` overrides the period, but not the certified tau_i."""

    watch_ns = 0

    def __init__(self, trigger: IndividualGains[X, W], radius: float, period_ns: int | None = None) -> None:
        if not 0 <= radius < float("inf"):
            raise ValueError(f"radius={radius}: expected the largest |x| to certify, 0 or more")
        certified_s = trigger.shortest_s(radius)
        self.certified_ns = int(certified_s * 1e9)
        self.period_ns = self.certified_ns if period_ns is None else period_ns
        if self.period_ns < 1:
            raise ValueError(f"period_ns={self.period_ns}: expected 1 or more")
        self.radius = radius
        self._trigger = trigger
        self._gain_per_s = trigger.gains.unified
        self._growth_per_s = trigger.system.growth_within(trigger.system.worst_inputs, radius)(certified_s)
        assert certified_s <= horizon_s(self._growth_per_s, self._gain_per_s, trigger.kappa)
        self.last: Decision | None = None

    def decide(self, measured_ns: int, x: X, inputs: W) -> Decision:
        self._trigger.predict(x, inputs)        # it refuses what is no measurement
        self.last = Decision(measured_ns, self.period_ns, self.certified_ns, self._gain_per_s, self._growth_per_s)
        return self.last

    def look(self, now_ns: int, x: X) -> Decision:
        assert self.last is not None, "look before decide"
        return self.last
