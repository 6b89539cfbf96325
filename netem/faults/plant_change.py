"""What changes a variable of a node's plant: a value of its own, or the value that was set, scaled or shifted."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Any, ClassVar

from netem.faults import Fault, Site, Target
from netem.faults.candidates import Between, Candidate, Fixed


@dataclass(frozen=True)
class PlantChange(Fault):
    """Exactly one of `value`, `factor` and `bias` is given."""

    inputs_only: ClassVar[bool] = False
    drawn: ClassVar[Between]                # factors that a search draws
    variable: str
    value: Any = None
    factor: float | None = None
    bias: float | None = None

    def __post_init__(self) -> None:
        given = [key for key in ("value", "factor", "bias") if getattr(self, key) is not None]
        if len(given) != 1:
            raise ValueError(f"variable={self.variable!r}: expected exactly one of value, factor and bias, "
                             f"got {' and '.join(given) or 'none'}")
        for key in ("factor", "bias"):
            number = getattr(self, key)
            if number is not None and not isfinite(number):
                raise ValueError(f"{key}={number}: expected a finite number")

    @classmethod
    def candidates(cls, site: Site) -> list[Candidate]:
        return [Candidate(node, {"variable": Fixed(variable), "factor": cls.drawn}) for node, plant in
                site.plants.items() for variable, is_input in plant.scalable().items() if is_input == cls.inputs_only]

    def refusal(self, target: Target, site: Site) -> str:
        node, = target
        if node not in site.plants:
            return f"{node} has no plant, so there is no variable to change"
        why = site.plants[node].refusal_of_change(self.variable, inputs_only=self.inputs_only,
                                                  scaled=self.value is None, value=self.value)
        return why and f"variable={self.variable!r}: {why}"

    def fields(self) -> dict[str, Any]:
        """Return what the node has to know."""
        how = "value" if self.value is not None else "factor" if self.factor is not None else "bias"
        return {"variable": self.variable, "how": how, "by": getattr(self, how)}
