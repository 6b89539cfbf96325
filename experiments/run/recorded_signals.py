"""Refuses a scenario that uses signals which no node records.

The runner calls it before the first grant, when every node has declared its signals. `guarantee_watch` has the check of
`[guarantees]`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from experiments.scenario.metric_keys import guarantee_figures, unknown_keys
from experiments.scenario.model import Scenario
from experiments.scenario.problems import ScenarioError, near


def refuse_unrecorded(scenario: Scenario, recorded: Mapping[str, Sequence[str]]) -> None:
    """`recorded` maps every agent and medium to the names of its signals; gateways have none. Raises ScenarioError."""
    known = {**dict.fromkeys(scenario.gateways, ()), **recorded,
             **{name: tuple(spec.signals) for name, spec in scenario.derived.items()}}
    figures = {name: guarantee_figures(guarantee.unit) for name, guarantee in scenario.guarantees.items()}
    problems = [*_not_derivable(scenario, known), *unknown_keys(scenario.expect, known, scenario.media, figures)]
    if problems:
        raise ScenarioError([f"{Path(scenario.path).name}: {problem}" for problem in problems])


def _not_derivable(scenario: Scenario, known: Mapping[str, Sequence[str]]) -> Iterator[str]:
    for name, spec in scenario.derived.items():
        for index, wanted in enumerate(spec.of):
            node, _, signal = wanted.partition(".")
            if signal not in known[node]:
                yield (f'derived.{name}.of[{index}]="{wanted}": {node} records no such signal; '
                       f"{near(signal, known[node])}")
