"""A robot's processor: how long its tasks take, which faults lengthen by factors that multiply."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import prod
from typing import Any


class Processor:
    """`factors` has the factor of each fault that acts; they outlive the program. `on_change` is called at a change."""

    def __init__(self) -> None:
        self.factors: list[float] = []
        self.slowness = 1.0             # product of `factors`
        self.on_change: Callable[[], object] | None = None

    def execution_ns(self, nominal_ns: int) -> int:
        """Return how long a task takes that takes `nominal_ns` without faults."""
        return nominal_ns if self.slowness == 1.0 else round(nominal_ns * self.slowness)

    def resume(self, factors: list[float]) -> None:
        self.factors = list(factors)
        self.slowness = prod(self.factors)

    def slow_down(self, fields: Mapping[str, Any]) -> None:
        """Begin or end (`begins` false) a fault with this `factor`."""
        if fields["begins"]:
            self.factors.append(fields["factor"])
        else:
            self.factors.remove(fields["factor"])
        self.slowness = prod(self.factors)
        if self.on_change is not None:
            self.on_change()
