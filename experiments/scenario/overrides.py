"""Applies `--set path.to.key=value`: replaces a value of the file, before it is validated, by a TOML value.

A path may add a key that the file leaves at its default, and any key to `[team]`, but no new agent, medium, impairment,
guarantee or expectation, where a name that is not in the file is taken for a typing error.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from typing import Any, Final

from experiments.scenario.problems import Place, Problems, near, path_text
from experiments.scenario.units import siblings

_PART: Final = re.compile(r"""(?P<bare>[A-Za-z0-9_-]+)|"(?P<double>[^"]*)"|'(?P<single>[^']*)'""")
_INDEX: Final = re.compile(r"\[(\d{1,9})\]")


def apply(document: dict[str, Any], overrides: Iterable[str], values: Mapping[str, Any], top_level: Sequence[str],
          problems: Problems) -> dict[str, Any]:
    """Change `document` by `overrides` as on the command line, then by `values`, Python values by path.

    Return the values of both by path, in an order in which they make the same change.
    """
    changes: dict[str, Any] = {}
    for override in overrides:
        place, value, complaint = _read(override)
        if complaint := complaint or _put(document, place, value, top_level):
            problems.say(f"--set {override}: {complaint}")
        else:
            _keep(changes, place, value)
    for path, value in values.items():
        place, rest = parse_path(path)
        complaint = _put(document, place, value, top_level) if place and not rest else \
            "expected path.to.key, as in impairments[0].loss_ratio"
        if complaint:
            problems.say(f"set {path!r}: {complaint}")
        else:
            _keep(changes, place, value)
    return changes


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


def _read(override: str) -> tuple[Place, Any, str]:
    """Return the place and the value of an override, and a problem of it or ""."""
    place, rest = parse_path(override)
    if not place or not rest.startswith("="):
        return (), None, "expected path.to.key=value, as in impairments[0].loss_ratio=0.3"
    try:
        return place, tomllib.loads(f"value = {rest[1:].strip()}")["value"], ""
    except (tomllib.TOMLDecodeError, RecursionError):
        return (), None, (f"{rest[1:].strip()!r} is not a TOML value; text needs quotes: "
                          f"'{path_text(place)}=\"...\"'")


def _keep(changes: dict[str, Any], place: Place, value: Any) -> None:
    """Add a change behind all others, in place of an earlier one of the same value."""
    path = _path(place)
    changes.pop(path, None)
    changes[path] = deepcopy(value)             # `document` has the value itself, and a later change may reach into it


def _path(place: Place) -> str:
    """Return the text that `parse_path` reads as this place."""
    text = ""
    for part in place:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            quote = "" if _PART.fullmatch(part) else "'" if '"' in part else '"'
            text += f"{'.' if text else ''}{quote}{part}{quote}"
    return text


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
            entry = f"{so_far}[{part}]" if part.isdigit() else f"{so_far}[0].{part}"
            remedy = f"; name the entry, as in {entry}" if isinstance(here, list) else ""
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
