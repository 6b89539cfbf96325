"""Refuses a scenario that uses signals which no node records.

The runner calls it before the first grant, when every node has declared its signals. `guarantee_watch` has the check of
`[guarantees]` about one signal.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from experiments.scenario.formula.check import Known, check
from experiments.scenario.guarantee_kinds import MONITORS
from experiments.scenario.metric_keys import guarantee_figures, unknown_keys
from experiments.scenario.model import Scenario
from experiments.scenario.problems import ScenarioError, near, path_text
from experiments.scenario.subjects import Named, links_in_formula


def refuse_unrecorded(scenario: Scenario, recorded: Mapping[str, Mapping[str, str]]) -> None:
    """`recorded` maps every agent and medium to the units of its signals; gateways have none. Raises ScenarioError."""
    known: dict[str, Mapping[str, str]] = {**{name: {} for name in scenario.gateways}, **recorded,
             **{name: spec.signals for name, spec in scenario.derived.items()}}
    figures = {name: guarantee_figures(guarantee.unit) for name, guarantee in scenario.guarantees.items()}
    costs = {name: spec.nodes for name, spec in scenario.costs.items()}
    asked = [key for key, bound in scenario.expect.items() if not bound.formula]
    problems = [*_not_derivable(scenario, known), *unknown_keys(asked, known, scenario.media, figures, costs),
                *_uncosted(scenario, known),
                *_formulas(scenario, known), *_guarantees(scenario, known)]
    if problems:
        raise ScenarioError([f"{Path(scenario.path).name}: {problem}" for problem in problems])


def _formulas(scenario: Scenario, known: Mapping[str, Mapping[str, str]]) -> Iterator[str]:
    for key, bound in scenario.expect.items():
        if bound.formula:
            names = Known(known, bound.links.__getitem__, scenario.length_ns,
                          {name: (spec.unit, spec.nodes) for name, spec in scenario.costs.items()})
            yield from (f"{path_text(('expect', key))}: {error.pointed()}" for error in check(bound.formula, names))


def _guarantees(scenario: Scenario, known: Mapping[str, Mapping[str, str]]) -> Iterator[str]:
    for name, guarantee in scenario.guarantees.items():
        if MONITORS[guarantee.kind].ON is Named.FORMULA:
            formula, links = links_in_formula(guarantee.subjects)
            names = Known(known, links.__getitem__, scenario.length_ns)
            yield from (f"{path_text(('guarantees', name, 'on'))}: {error.pointed()}"
                        for error in check(formula, names, at_end=False))


def _uncosted(scenario: Scenario, known: Mapping[str, Mapping[str, str]]) -> Iterator[str]:
    for name, spec in scenario.costs.items():
        for wanted in spec.signals:
            node, _, signal = wanted.partition(".")
            if signal not in known[node]:
                yield f'costs.{name}="{wanted}": {node} records no such signal; {near(signal, known[node])}'


def _not_derivable(scenario: Scenario, known: Mapping[str, Collection[str]]) -> Iterator[str]:
    for name, spec in scenario.derived.items():
        for index, wanted in enumerate(spec.of):
            node, _, signal = wanted.partition(".")
            if signal not in known[node]:
                yield (f'derived.{name}.of[{index}]="{wanted}": {node} records no such signal; '
                       f"{near(signal, known[node])}")
