"""Names, units of time and paths of a table, before its types are looked at.

Unknown and missing keys are said here, where the class that a table is for is known; times become nanoseconds and paths
start from the scenario's folder. A key `file` is a path.
"""

from __future__ import annotations

import types
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from experiments.scenario.problems import Place, Problems, near, nearest
from experiments.scenario.shape import Shape, shape_of
from experiments.scenario.units import spellings, to_ns


@dataclass
class Prepared:
    """What `prepare` has found out. Paths are those of the prepared table, without the place of the whole."""

    problems: Problems
    place: Place
    folder: Path
    found_before: int                                               # problems, when this table was begun
    written: dict[Place, str] = field(default_factory=dict)         # field at a path -> key as the author wrote it
    raw: dict[Place, Any] = field(default_factory=dict)             # and the value, where it was converted
    chosen: dict[Place, set[Any]] = field(default_factory=dict)     # class and kind of the table at a path
    wrong: set[str | int] = field(default_factory=set)              # fields of the whole with a problem

    def place_of(self, path: Place) -> Place:
        return (*self.place, *(self.written.get(path[:end + 1], part) for end, part in enumerate(path)))


def prepare_table(prepared: Prepared, shape: Shape, table: Mapping[str, Any], path: Place,
                   besides: Iterable[str] = ()) -> dict[str, Any]:
    field_of = {key: (name, unit) for name in shape.hints
                for key, unit in (spellings(name) or {name: ""}).items()}
    ready: dict[str, Any] = {}
    guessed: set[str] = set()
    for key, value in table.items():
        place = (*prepared.place_of(path), key)
        if key not in field_of:
            known = [*shape.keys(), *besides]
            prepared.problems.add(place, f"unknown key; {near(key, known)}", value)
            guess = nearest(key, known)
            if guess in field_of:
                guessed.add(field_of[guess][0])
            continue
        name, unit = field_of[key]
        here = (*path, name)
        if here in prepared.written:
            prepared.problems.add(place, f"the same as {prepared.written[here]}, which is given too; keep one", value)
            continue
        prepared.written[here] = key
        prepared.raw[here] = value
        before = prepared.problems.found
        if unit:
            ready[name] = to_ns(value, unit, lambda within, rule, part, place=place:        # type: ignore[misc]
                                prepared.problems.add((*place, *within), rule, part))
        else:
            ready[name] = _prepare(prepared, shape.hints[name], value, here)
        if prepared.problems.found > before:
            prepared.wrong.add(here[0])
    for name in shape.hints:
        if name in shape.required and name not in ready and name not in guessed:
            keys = list(spellings(name) or [name])
            remedy = f"; write it in one of {', '.join(keys)}" if len(keys) > 1 else ""
            prepared.problems.add((*prepared.place_of(path), keys[0]), f"is missing{remedy}")
    return ready


def _prepare(prepared: Prepared, hint: Any, value: Any, path: Place) -> Any:
    kinds = _members(hint)
    if isinstance(value, dict):
        classes = [kind for kind in kinds if isinstance(kind, type) and is_dataclass(kind)]
        if classes:
            chosen = _choose(classes, value)
            prepared.chosen[path] = {chosen.__name__, str(value.get("kind"))}
            return prepare_table(prepared, shape_of(chosen), value, path)
        mapping = next((kind for kind in kinds if get_origin(kind) in (dict, Mapping)
                        or (isinstance(get_origin(kind), type) and issubclass(get_origin(kind), Mapping))), None)
        if mapping is not None:
            return {key: _prepare(prepared, get_args(mapping)[1], part, (*path, key)) for key, part in value.items()}
    if isinstance(value, list):
        return [_prepare(prepared, _element(kinds, index), part, (*path, index)) for index, part in enumerate(value)]
    if isinstance(value, str) and value and (Path in kinds or (path[-1] == "file" and Any not in kinds)):
        return str(prepared.folder / value)
    return value


def _members(hint: Any) -> list[Any]:
    """The types that `hint` allows."""
    if get_origin(hint) is Annotated:
        return _members(get_args(hint)[0])
    if get_origin(hint) in (Union, types.UnionType):
        return [kind for part in get_args(hint) for kind in _members(part)]
    return [hint]


def _element(kinds: Sequence[Any], index: int) -> Any:
    """The type of the element `index` of a list, or Any."""
    for kind in kinds:
        origin, parts = get_origin(kind), get_args(kind)
        if origin is tuple and parts and parts[-1] is not Ellipsis:
            return parts[min(index, len(parts) - 1)]
        if isinstance(origin, type) and issubclass(origin, Sequence | set | frozenset) and parts:
            return parts[0]
    return Any


def _choose(classes: Sequence[type], table: Mapping[str, Any]) -> type:
    """The class that a table is meant for: its `kind` says so, or the most of its keys fit."""
    def fit(cls: type) -> tuple[bool, int, int]:
        shape = shape_of(cls)
        kind = shape.hints.get("kind")
        says_so = get_origin(kind) is Literal and table.get("kind") in get_args(kind)
        return says_so, len(set(shape.keys()) & set(table)), -len(shape.required)

    return max(classes, key=fit)
