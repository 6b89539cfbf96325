"""What reading one section of a scenario needs, and what sections share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from experiments.scenario.problems import Place, Problems
from experiments.scenario.vocabulary import Vocabulary

SECTIONS: Final = ("team", "agents", "agents_defaults", "media", "gateways", "impairments", "derived", "guarantees",
                   "records", "expect")
NAME_RULE: Final = "a name has letters, digits, - and _, and starts with a letter"


@dataclass(frozen=True)
class Reading:
    """The whole file, and where what is wrong with it is collected. A mistake in one section hides none in another."""

    document: dict[str, Any]
    folder: Path
    problems: Problems
    vocabulary: Vocabulary

    def section(self, key: str) -> dict[str, Any]:
        table = self.document.get(key, {})
        if isinstance(table, dict):
            return table
        self.problems.add((key,), "expected a table", table)
        return {}

    def check_name(self, place: Place, name: str) -> None:
        plain = name.isascii() and name.replace("-", "").replace("_", "").isalnum() and name[:1].isalpha()
        if not plain:
            self.problems.add(place, NAME_RULE)


def holds(table: Any, path: Place) -> bool:
    """Whether there is something at `path` within `table`."""
    for part in path:
        entries = range(len(table)) if isinstance(table, list) else table if isinstance(table, dict) else ()
        if part not in entries:
            return False
        table = table[part]
    return True
