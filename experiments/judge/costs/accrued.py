"""The costs of a run, by the specifications in its resolved scenario."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce

from experiments.judge.costs import Cost
from experiments.judge.formula import curve as curves
from experiments.judge.formula.curve import Curve
from experiments.judge.run_data import RunData
from experiments.scenario.cost_kinds import COSTS


def accrued(name: str, node: str, data: RunData) -> Curve:
    """Return the cost `name` up to each instant: of one node, or summed over all parts if `node` is "".

    Raises NotAccrued if the run has no records for it, KeyError for a cost or a node that the scenario does not have.
    """
    spec: Mapping[str, object] = data.scenario["costs"][name]
    cost: Cost = COSTS[str(spec["kind"])](**spec["fields"])  # type: ignore[arg-type]
    parts = cost.accrue(data)
    return parts[node] if node else reduce(curves.plus, parts.values())


def parts_of(data: RunData) -> dict[str, tuple[str, ...]]:
    """Return the names of the nodes for which each cost has a part of its own."""
    return {name: tuple(spec["nodes"]) for name, spec in (data.scenario.get("costs") or {}).items()}
