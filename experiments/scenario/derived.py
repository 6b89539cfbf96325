"""Reads `[derived.NAME]`: signals that are computed from recorded ones after the run."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from experiments.programs.own_modules import function_for
from experiments.scenario.model import DerivedSpec
from experiments.scenario.problems import Place, near
from experiments.scenario.sections import Reading
from experiments.scenario.shape import shape_of


@dataclass(frozen=True)
class Table:
    """A table `[derived.NAME]`; `signals` maps the name of each result to its unit."""

    function: str
    of: list[str]
    signals: dict[str, str]
    parameters: dict[str, Any] = field(default_factory=dict)


def read_derived(tables: Mapping[str, Any], agents: Collection[str], reading: Reading) -> dict[str, DerivedSpec]:
    """Return the tables without mistakes. Signals of nodes are not checked, as nodes declare them when they start."""
    derived: dict[str, DerivedSpec] = {}
    known: dict[str, Collection[str]] = {}
    for name, raw in tables.items():
        place = ("derived", name)
        reading.check_name(place, name)
        if name in agents:
            reading.problems.add(place, "is the name of an agent already; take another one")
        table = reading.tables.read(shape_of(Table), raw, place, (), Table).made
        if table is None:
            continue
        _check(table, place, agents, known, reading)
        known[name] = table.signals
        derived[name] = DerivedSpec(table.function, tuple(table.of), table.signals, table.parameters)
    return derived


def _check(table: Table, place: Place, agents: Collection[str], known: Mapping[str, Collection[str]],
           reading: Reading) -> None:
    problems = reading.problems
    try:
        function_for(table.function, reading.folder)
    except ValueError as error:
        problems.add((*place, "function"), str(error), table.function)
    except Exception as error:
        problems.add((*place, "function"), f"importing it failed: {type(error).__name__}: {error}", table.function)
    if not table.of:
        problems.add((*place, "of"), "expected at least one signal, \"node.signal\"", table.of)
    if not table.signals:
        problems.add((*place, "signals"), "expected at least one, { name = \"unit\" }", table.signals)
    for index, wanted in enumerate(table.of):
        node, dot, signal = wanted.partition(".")
        here = (*place, "of", index)
        if not dot or not signal:
            problems.add(here, "expected \"node.signal\"", wanted)
        elif node in known and signal not in known[node]:
            problems.add(here, f"{node} has no signal {signal!r}; {near(signal, known[node])}", wanted)
        elif node not in known and node not in agents:
            problems.add(here, f"there is no agent or earlier derived signal {node!r}; {near(node, [*agents, *known])}",
                         wanted)
