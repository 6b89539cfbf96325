"""The scenario that a search changes: its tables as they are written, with the changes of the command line.

    file + --set --tables--> Base --values by path--> points of `Workers`, or a file of its own
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from experiments.programs.own_modules import imported_from
from experiments.scenario import overrides as overriding
from experiments.scenario.document import read
from experiments.scenario.impairment_kind import impairment_class
from experiments.scenario.loader import Header, load_tables
from experiments.scenario.model import ImpairmentSpec, Scenario
from experiments.scenario.problems import Problems, ScenarioError
from experiments.scenario.sections import SECTIONS
from experiments.scenario.shape import shape_of
from experiments.sweep.messages import Source
from netem.core.link_name import LinkName
from netem.impairments.contract import only_loses

NUMBERS: Final = re.compile(r"\[\n\s*((?:[-+\d.eE,\s]|\[[-+\d.eE,\s\[\]]*\]|true|false)*?),?\s*\]")

Tables = dict[str, Any]


class NoPlace(ValueError):
    """A scenario cannot be written where it was asked for."""

    exit_code = 2


@dataclass(frozen=True)
class Base:
    """`tables` is the document with all changes; `scenario` what they are; `source` leads workers to the same."""

    path: Path
    question: str
    tables: Tables
    scenario: Scenario
    source: Source

    @classmethod
    def of(cls, path: Path, overrides: Sequence[str] = (), values: Mapping[str, Any] | None = None) -> Base:
        """Read the file and change it, as `load_tables` does; ScenarioError lists what is wrong."""
        tables, question = read(path)
        scenario = load_tables(deepcopy(tables), question, path, overrides=overrides, values=values)
        _apply(path, tables, scenario.changes)
        return cls(path, question, tables, scenario, Source.of(path, values=scenario.changes))

    def changed(self, values: Mapping[str, Any]) -> Tables:
        """Return a copy of the tables with values set by path; ScenarioError for a path that is not there."""
        tables = deepcopy(self.tables)
        _apply(self.path, tables, values)
        return tables

    def loads_in(self, folder: Path) -> str:
        """Return why the scenario cannot be read from a file in `folder`, "" if it can."""
        try:
            load_tables(deepcopy(self.tables), self.question, folder / self.path.name)
        except ScenarioError as error:
            return error.problems[0]
        return ""

    def place(self, ending: str, folder: Path | None) -> Path:
        """Return a file that is not there yet, in `folder` or where the scenario finds its programs."""
        if folder is None:
            package = Path(str(files("scenarios"))).resolve()
            # A program beside the scenario may load from elsewhere in this process alone, as from its current folder.
            beside = self.path.resolve().parent != package and (
                imported_from(self.path.parent) or bool(self.loads_in(Path("runs"))))
            folder = self.path.parent if beside else Path("runs")
        elif problem := self.loads_in(folder):
            raise NoPlace(f"{folder}: {self.path.name} does not load from there: {problem}: name its own folder, "
                          f"{self.path.parent}")
        stem = f"{self.path.stem}_{ending}"
        names = (f"{stem}.toml", *(f"{stem}_{number}.toml" for number in range(2, 10_000)))
        return next(folder / name for name in names if not (folder / name).exists())


def _apply(path: Path, tables: Tables, values: Mapping[str, Any]) -> None:
    problems = Problems(path.name)
    overriding.apply(tables, (), values, [*shape_of(Header).keys(), *SECTIONS], problems)
    problems.stop_if_any()


def pure_losses(scenario: Scenario) -> list[tuple[int, ImpairmentSpec]]:
    """Return the impairments that do nothing but lose copies, with their places in the list."""
    return [(index, spec) for index, spec in enumerate(scenario.impairments)
            if only_loses(impairment_class(spec.kind, scenario.folder))]


def on_text(link: LinkName) -> str:
    return f"{link[0]}: {link[1]} -> {link[2]}"


def toml_of(tables: Tables, told: str, question: str) -> str:
    """Return the text of a scenario file that opens with what it is, and with its question."""
    import tomli_w

    comment = [*told.splitlines(), *([f"Question: {question}"] if question else [])]
    text = tomli_w.dumps({key: value for key, value in tables.items() if value not in ([], {})})
    return "".join(f"# {line}\n" for line in comment) + NUMBERS.sub(_on_one_line, text)


def _on_one_line(found: re.Match[str]) -> str:
    inside = re.sub(r"\s+", " ", found[1]).strip()
    return "[" + re.sub(r",? \]", "]", re.sub(r"\[ ", "[", inside)) + "]"
