"""Applies `--set path.to.key=value`: replaces a value of the file, before it is validated, by a TOML value.

A path may add a key that the file leaves at its default, and any key to `[team]`, but no new agent, medium, impairment,
guarantee or expectation, where a name that is not in the file is taken for a typing error.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from experiments.scenario.problems import Place, Problems, near, path_text
from experiments.scenario.units import siblings

_PART: Final = re.compile(r"""(?P<bare>[A-Za-z0-9_-]+)|"(?P<double>[^"]*)"|'(?P<single>[^']*)'""")
_INDEX: Final = re.compile(r"\[(\d{1,9})\]")


def apply(document: dict[str, Any], overrides: Iterable[str], values: Mapping[str, Any], top_level: Sequence[str],
          problems: Problems) -> None:
    """Change `document` by `overrides` as on the command line, then by `values`, Python values by path."""
    for override in overrides:
        if complaint := _apply(document, override, top_level):
            problems.say(f"--set {override}: {complaint}")
    for path, value in values.items():
        place, rest = parse_path(path)
        complaint = _put(document, place, value, top_level) if place and not rest else \
            "expected path.to.key, as in impairments[0].loss_ratio"
        if complaint:
            problems.say(f"set {path!r}: {complaint}")


def parse_path(text: str) -> tuple[Place, str]:
    """Return the path at the beginning of `text` and the rest of the text."""
    place: Place = ()
    rest = text.strip()
    while True:
        part = _PART.match(rest)
        if part is None:
            return (), text
        place = (*place, next(group for group in part.groups() if group is not None))
        rest = rest[part.end():]
        while index := _INDEX.match(rest):
            place = (*place, int(index[1]))
            rest = rest[index.end():]
        if not rest.startswith("."):
            return place, rest.lstrip()
        rest = rest[1:]


def look_up(document: Mapping[str, Any], dotted: str) -> tuple[dict[str, Any], str]:
    """Return the table at a path, and a problem of the path or ""."""
    path, rest = parse_path(dotted)
    if not path or rest:
        return {}, "expected the path of a table, as in team.models.r1"
    here: Any = document
    for depth, part in enumerate(path):
        if not holds(here, (part,)):
            where = path_text(path[:depth]) or "this file"
            return {}, f"{where} has no {part!r}; {near(part, here if isinstance(here, dict) else ())}"
        here = here[part]
    return (here, "") if isinstance(here, dict) else ({}, "is no table")


def holds(table: Any, path: Place) -> bool:
    """Return whether `table` has a value at `path`."""
    for part in path:
        entries = range(len(table)) if isinstance(table, list) else table if isinstance(table, dict) else ()
        if part not in entries:
            return False
        table = table[part]
    return True


def _apply(document: dict[str, Any], override: str, top_level: Sequence[str]) -> str:
    """Change `document`; return a problem of the override or ""."""
    place, rest = parse_path(override)
    if not place or not rest.startswith("="):
        return "expected path.to.key=value, as in impairments[0].loss_ratio=0.3"
    try:
        value = tomllib.loads(f"value = {rest[1:].strip()}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        return f"{rest[1:].strip()!r} is not a TOML value; text needs quotes: '{path_text(place)}=\"...\"'"
    return _put(document, place, value, top_level)


def _put(document: dict[str, Any], place: Place, value: Any, top_level: Sequence[str]) -> str:
    """Change `document`; return a problem of the place or ""."""
    here: Any = document
    for depth, part in enumerate(place):
        so_far, last = path_text(place[:depth]), depth == len(place) - 1
        if isinstance(part, int):
            if not isinstance(here, list):
                return f"{so_far} is no list"
            if part >= len(here):
                return f"{so_far} has {len(here)} entries, the first is [0]"
            if last:
                here[part] = value
            here = here[part]
            continue
        if not isinstance(here, dict):
            remedy = f"; name the entry, as in {so_far}[0].{part}" if isinstance(here, list) else ""
            return f"{so_far} is no table{remedy}"
        if part not in here:
            if depth == 0 and part not in [*top_level, *here]:
                return f"unknown key; {near(part, [*top_level, *here])}"
            if _author_names_keys(place[:depth]):
                return f"{so_far} has no {part!r}; {near(part, here)}"
        if last:
            for other in siblings(part):
                here.pop(other, None)
            here[part] = value
        else:
            here = here.setdefault(part, [] if isinstance(place[depth + 1], int) else {})
    return ""


def _author_names_keys(parent: Place) -> bool:
    """Return whether the author chooses the keys of this table, rather than the file format."""
    return parent in (("agents",), ("media",), ("guarantees",), ("costs",), ("expect",))
