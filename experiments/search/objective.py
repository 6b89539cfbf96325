"""What a search makes as small, or as large, as it can: a figure of `[expect]`, or the robustness of a formula.

    cost = value, or -value where the figure is to become large
    a run that fails costs -inf: it is the worst there is; one without such a figure costs +inf
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isnan
from typing import Any, Final

from experiments.judge.figures import Figures
from experiments.scenario import metric_keys
from experiments.search.base import Base
from experiments.search.budget import BadBudget

NAME: Final = "searched"
UNBOUNDED: Final = 1e300


@dataclass(frozen=True)
class Objective:
    """`key` of `[expect]` has the figure; `entry` is what is added there, None if it is there."""

    key: str
    entry: Any
    largest: bool = False

    @classmethod
    def of(cls, text: str, base: Base, *, largest: bool = False) -> Objective:
        """Read a key of the scenario's `[expect]`, a figure's key, or a formula; the loader judges the latter two."""
        expected = base.tables.get("expect", {})
        text = text.strip()
        if text in base.scenario.expect:
            return cls(text, None, largest)
        if metric_keys.parse(text) is not None:
            return cls(text, {"max" if largest else "min": UNBOUNDED if largest else -UNBOUNDED}, largest)
        name = next(name for name in (NAME, *(f"{NAME}_{number}" for number in range(2, 1000)))
                    if name not in expected)
        return cls(name, text, largest)

    @classmethod
    def of_either(cls, minimize: str | None, maximize: str | None, base: Base) -> Objective:
        """Read the one of both that is given; BadBudget for both or none."""
        if (minimize is None) == (maximize is None):
            raise BadBudget("what is the search to make worse? Give --minimize or --maximize with a formula, as in "
                            "--minimize 'always r1.gap > 0.5 m', or a figure's key")
        return cls.of(minimize or maximize or "", base, largest=maximize is not None)

    def cost(self, figures: Figures) -> float:
        if figures.failure:
            return -inf
        value = figures.values.get(self.key)
        if value is None or isnan(value):
            return inf
        return -value if self.largest else value

    def value(self, cost: float) -> float:
        return -cost if self.largest else cost

    def expect(self, expected: dict[str, Any], without: float) -> dict[str, Any]:
        """Return the tables of `[expect]` with the figure; of one without bounds, `without` becomes the bound.

        `without` is the figure without losses and faults, so that the pattern breaks the expectation.
        """
        entry = self.entry
        if isinstance(entry, dict):
            entry = dict.fromkeys(entry, without)
        return dict(expected) if entry is None else {**expected, self.key: entry}

    @property
    def text(self) -> str:
        return self.entry if isinstance(self.entry, str) else self.key
