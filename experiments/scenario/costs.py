"""Reads `[costs.NAME]`: figures of the run that grow with time, such as energy."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from experiments.scenario.cost_kinds import COSTS
from experiments.scenario.model import CostSpec, DerivedSpec, MediumSpec
from experiments.scenario.problems import Place, near
from experiments.scenario.sections import Reading
from experiments.scenario.shape import shape_of
from experiments.scenario.subjects import Named, subjects_of


def read_costs(tables: Mapping[str, Any], nodes: Collection[str], media: Mapping[str, MediumSpec],
               derived: Mapping[str, DerivedSpec], reading: Reading) -> dict[str, CostSpec]:
    """Return the costs of known kinds without mistakes; `nodes` are all names under which signals are recorded."""
    found: dict[str, CostSpec] = {}
    for name, table in tables.items():
        place: Place = ("costs", name)
        reading.check_name(place, name)
        if not isinstance(table, dict):
            reading.problems.add(place, "expected a table", table)
            continue
        kind = table.get("kind")
        cls = COSTS.get(kind) if isinstance(kind, str) else None
        if cls is None:
            rule = "is missing; " if kind is None else "no such kind; "
            reading.problems.add((*place, "kind"), rule + near(kind or "", COSTS), *([] if kind is None else [kind]))
            continue
        own = {key: value for key, value in table.items() if key != "kind"}
        filled = reading.tables.read(shape_of(cls), own, place, ["kind"], cls)
        if filled.made is not None:
            parts = _parts(cls.ON, filled.made.subjects, place, nodes, media, derived, reading)
            found[name] = CostSpec(str(kind), filled.values, cls.UNIT, parts, tuple(filled.made.subjects)
                                   if cls.ON is Named.SIGNALS else ())
    return found


def _parts(named: Named, subjects: Collection[str], place: Place, nodes: Collection[str],
           media: Mapping[str, MediumSpec], derived: Mapping[str, DerivedSpec], reading: Reading) -> tuple[str, ...]:
    """Return the nodes for which the cost has a part of its own; problems of its subjects are added."""
    nodes_on = {name: medium.nodes for name, medium in media.items()}
    parts: dict[str, None] = {}
    for subject in subjects:
        try:
            found = subjects_of(named, subject, nodes_on, (), nodes)
        except ValueError as error:
            reading.problems.add(place, str(error), subject)
            continue
        if named is Named.SENDERS:
            parts |= dict.fromkeys(node for _, node in found)
            continue
        node, signal = found[0]
        if len(found) > 1 or node != subject.partition(".")[0]:
            reading.problems.add(place, "a pattern names several signals; write each of them", subject)
        elif node in derived and signal not in derived[node].signals:
            reading.problems.add(place, f"derived.{node} has no signal {signal!r}; "
                                 f"{near(signal, derived[node].signals)}", subject)
    return tuple(parts)
