"""The sections of a scenario file, and the context with which each is read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from experiments.scenario.problems import Place, Problems
from experiments.scenario.table_reader import TableReader

_TABLE: Final = dict, "expected a table"
SECTIONS: Final[Mapping[str, tuple[type, str]]] = {     # name -> type, and the rule in an error about another type
    "team": _TABLE, "agents": _TABLE, "agents_defaults": _TABLE, "media": _TABLE, "gateways": _TABLE,
    "network": _TABLE, "real_time": _TABLE,
    "impairments": (list, "expected a list: write [[impairments]]"),
    "faults": (list, "expected a list: write [[faults]]"), "derived": _TABLE, "guarantees": _TABLE,
    "records": _TABLE, "costs": _TABLE, "expect": _TABLE}
NAME_RULE: Final = "a name has letters, digits, - and _, and starts with a letter"


@dataclass(frozen=True)
class Reading:
    """The folder to which paths are relative, and the problems found so far; sections are read independently."""

    folder: Path
    problems: Problems

    @property
    def tables(self) -> TableReader:
        return TableReader(self.problems, self.folder)

    def check_name(self, place: Place, name: str) -> None:
        plain = name.isascii() and name.replace("-", "").replace("_", "").isalnum() and name[:1].isalpha()
        if not plain:
            self.problems.add(place, NAME_RULE)
