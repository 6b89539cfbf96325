"""What reading one section of a scenario needs, and what sections share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from experiments.scenario.problems import Place, Problems
from experiments.scenario.table_reader import TableReader

_TABLE: Final = dict, "expected a table"
SECTIONS: Final[Mapping[str, tuple[type, str]]] = {     # what each is, and what to say if it is not
    "team": _TABLE, "agents": _TABLE, "agents_defaults": _TABLE, "media": _TABLE, "gateways": _TABLE,
    "impairments": (list, "expected a list: write [[impairments]]"), "derived": _TABLE, "guarantees": _TABLE,
    "records": _TABLE, "expect": _TABLE}
NAME_RULE: Final = "a name has letters, digits, - and _, and starts with a letter"


@dataclass(frozen=True)
class Reading:
    """Where paths start from and problems are collected. A mistake in one section hides none in another."""

    folder: Path
    problems: Problems

    @property
    def tables(self) -> TableReader:
        return TableReader(self.problems, self.folder)

    def check_name(self, place: Place, name: str) -> None:
        plain = name.isascii() and name.replace("-", "").replace("_", "").isalnum() and name[:1].isalpha()
        if not plain:
            self.problems.add(place, NAME_RULE)
