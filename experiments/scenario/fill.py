"""One table of the file into the fields of one class: names, units and types, with every mistake at its place.

    raw table --table_names--> known keys, times in ns --table_types--> typed values --construct--> the class's rules
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from experiments.scenario.problems import Place, Problems
from experiments.scenario.refusals import refuse
from experiments.scenario.shape import Shape, shape_of
from experiments.scenario.table_names import Prepared, prepare_table
from experiments.scenario.table_types import typed


class Filled(NamedTuple):
    values: dict[str, Any]          # of the fields that are given and in order
    complete: bool                  # nothing was wrong


def fill(shape: Shape, table: Any, place: Place, problems: Problems, folder: Path,
         besides: Iterable[str] = ()) -> Filled:
    """Values for the fields given in `table`. `besides`: keys of the table that are read elsewhere."""
    before = problems.found
    if not isinstance(table, dict):
        problems.add(place, "expected a table", table)
        return Filled({}, False)
    prepared = Prepared(problems, place, folder, before)
    ready = prepare_table(prepared, shape, table, (), besides)
    values = typed(shape, prepared, ready)
    return Filled(values, problems.found == before)


def construct(cls: type, table: Any, place: Place, problems: Problems, folder: Path, besides: Iterable[str] = (),
              **passed: Any) -> Any:
    """An instance of the dataclass `cls` with the fields of `table` and those `passed`, or None with problems."""
    filled = fill(shape_of(cls), table, place, problems, folder, besides)
    if not filled.complete:
        return None
    try:
        return cls(**filled.values, **passed)
    except (ValueError, OSError) as error:
        refuse(error, table, place, problems)
        return None
