"""Reads `[expect]`: bounds on figures of the run, judged at its end."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from experiments.scenario.metric_keys import guarantee_figures, over_a_window, unknown_keys
from experiments.scenario.model import Bound, GuaranteeSpec
from experiments.scenario.sections import Reading
from experiments.scenario.shape import Shape

SHAPE = Shape({"min": float, "max": float, "during_ns": tuple[int, int]}, frozenset())


def read_expect(tables: Mapping[str, Any], nodes: Collection[str], media: Collection[str],
                guarantees: Mapping[str, GuaranteeSpec], reading: Reading) -> dict[str, Bound]:
    """Return the bounds by key; problems are added to `reading`.

    `nodes` are all names under which signals and counters are recorded: agents, gateways, derived signals, media.
    """
    bounds: dict[str, Bound] = {}
    problems = reading.problems
    for key, table in tables.items():
        place = ("expect", key)
        filled = reading.tables.read(SHAPE, table, place)
        bound = bounds[key] = Bound(**filled.values)
        if not filled.complete:
            continue
        if bound.min is None and bound.max is None:
            problems.add(place, "expects nothing; give min, max or both", table)
        elif bound.min is not None and bound.max is not None and bound.min > bound.max:
            problems.add(place, "expected min <= max", table)
        if bound.during_ns is not None:
            if not 0 <= bound.during_ns[0] < bound.during_ns[1]:
                problems.add(place, "during: expected 0 <= start < end", table)
            elif not over_a_window(key):
                problems.add(place, "during: only signals, numbers of frames and the delivery ratio can be judged over "
                             "a part of the run", table)
    figures = {name: guarantee_figures(guarantee.unit) for name, guarantee in guarantees.items()}
    for line in unknown_keys(bounds, list(nodes), list(media), figures):
        problems.say(line)
    return bounds
