"""Reads `[expect]`: bounds on figures of the run and formulas of temporal logic, judged at its end."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import msgspec

from experiments.scenario.formula.check import Known, check, links_of
from experiments.scenario.metric_keys import guarantee_figures, over_a_window, parse, unknown_keys
from experiments.scenario.model import Bound, GuaranteeSpec
from experiments.scenario.problems import Place, Problems, path_text
from experiments.scenario.sections import Reading
from experiments.scenario.shape import Shape

SHAPE = Shape({"min": float, "max": float, "during_ns": tuple[int, int], "formula": str, "share": float},
              frozenset())


def read_expect(tables: Mapping[str, Any], nodes: Collection[str], media: Collection[str],
                guarantees: Mapping[str, GuaranteeSpec], known: Known, reading: Reading) -> dict[str, Bound]:
    """Return the bounds by key; problems are added to `reading`.

    `nodes` are all names under which signals and counters are recorded: agents, gateways, derived signals, media;
    `known` has those that formulas may use.
    """
    bounds: dict[str, Bound] = {}
    formulas: set[str] = set()
    problems = reading.problems
    for key, written in tables.items():
        place: Place = ("expect", key)
        table = {"formula": written} if isinstance(written, str) else written
        filled = reading.tables.read(SHAPE, table, place)
        bound = bounds[key] = Bound(**filled.values)
        if not filled.complete:
            continue
        check_share(bound.share, place, problems)
        if "formula" in filled.values:
            formulas.add(key)
            at = place if table is not written else (*place, "formula")
            bounds[key] = _formula(key, bound, at, known, reading)
        elif bound.min is None and bound.max is None:
            problems.add(place, "expects nothing; give min, max or both", table)
        if bound.min is not None and bound.max is not None and bound.min > bound.max:
            problems.add(place, "expected min <= max", table)
        if bound.during_ns is not None:
            if not 0 <= bound.during_ns[0] < bound.during_ns[1]:
                problems.add(place, "during: expected 0 <= start < end", table)
            elif key in formulas:
                problems.add(place, "during: a formula has its intervals in itself: always[start, end] ...", table)
            elif not over_a_window(key):
                problems.add(place, "during: only signals, numbers of frames and the delivery ratio can be judged over "
                             "a part of the run", table)
    figures = {name: guarantee_figures(guarantee.unit) for name, guarantee in guarantees.items()}
    for line in unknown_keys([key for key in bounds if key not in formulas], list(nodes), list(media), figures,
                             {name: nodes_of for name, (_, nodes_of) in known.costs.items()}):
        problems.say(line)
    return bounds


def check_share(share: float | None, place: Place, problems: Problems) -> None:
    """Add a problem for a share that no number of runs could show, or that says nothing."""
    if share is not None and not 0 < share < 1:
        problems.add((*place, "share"), "expected more than 0 and less than 1, the share of a campaign's runs that "
                     "keep it; leave it out where every run has to", share)


def _formula(key: str, bound: Bound, place: Place, known: Known, reading: Reading) -> Bound:
    """Return the bound with the links of its formula, or as it is if there are problems, which are added."""
    if parse(key) is not None:
        reading.problems.add(("expect", key), "names a figure: expected a table with min, max or both; a formula gets "
                             "a name of its own")
        return bound
    found = check(bound.formula, known)
    for error in found:
        reading.problems.say(f"{path_text(place)}: {error.pointed()}")
    return bound if found else msgspec.structs.replace(bound, links=links_of(bound.formula, known))
