"""Turns the error that a class raises at construction into problems with their place in the file."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Final

from experiments.scenario.files_there import files_like, near_file
from experiments.scenario.problems import Place, Problems, path_text, value_text
from experiments.scenario.units import spellings

_NAMED_VALUE: Final = re.compile(r"([A-Za-z_]\w*)=(.+?): ", re.DOTALL)


def refuse(error: Exception, table: Any, place: Place, problems: Problems) -> None:
    """Add a problem for each line of `error`, `field=value: rule; remedy` or free text, raised for `table`."""
    missing = error if isinstance(error, FileNotFoundError) else error.__cause__
    remedy = ""
    if isinstance(missing, FileNotFoundError) and missing.filename:
        remedy = f"; {near_file(str(missing.filename), files_like(Path(missing.filename)))}"
    for line in (str(error) + remedy).splitlines() or [type(error).__name__]:
        named = _NAMED_VALUE.match(line)
        keys = (spellings(named[1]) or [named[1]]) if named else []
        key = next((key for key in keys if isinstance(table, dict) and key in table), None)
        if named is None or key is None:
            where = path_text(problems.written_at(place))
            problems.say(f"{where}: {line}" if where else line)
        elif key == named[1]:
            value = value_text(table[key]) if isinstance(table[key], str | dict) else named[2]
            problems.say(f"{path_text(problems.written_at((*place, key)))}={value}: {line[named.end():]}")
        else:
            written = f"{path_text(problems.written_at((*place, key)))}={value_text(table[key])}"
            problems.say(f"{written} ({line[:named.end() - 2]}): {line[named.end():]}")
