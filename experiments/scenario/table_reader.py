"""Reads a table of the file into the fields of a class, in one pass: names, units of time, types, limits, own rules.

    table --each key--> field, unit --its type hint--> value --all of them--> the class, which may raise

Every mistake is added to `problems` at its place, with the value as its author wrote it. Times become nanoseconds;
paths, and text under the key `file`, are relative to the scenario's folder. Pydantic converts types that
`TableReader.value` does not know (`foreign_types`); a scenario without them does not import it.
"""

from __future__ import annotations

import operator
import types
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import is_dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple, Union, get_args, get_origin

from annotated_types import Ge, GroupedMetadata, Gt, Le, Lt

from experiments.scenario.foreign_types import judge
from experiments.scenario.problems import Place, Problems, near, value_text
from experiments.scenario.refusals import refuse
from experiments.scenario.shape import Shape, shape_of
from experiments.scenario.units import spellings, to_ns
from netem.core.nearest import nearest
from netem.topology.told_apart import ToldApartBy

WRONG: Final = object()         # replaces a value with a problem that has been added
NONE: Final = type(None)
LISTS: Final[Mapping[Any, Callable[[list[Any]], Any]]] = {
    list: list, Sequence: list, tuple: tuple, set: set, frozenset: frozenset}
LIMITS: Final[Mapping[type, tuple[str, str, Callable[[Any, Any], bool]]]] = {
    Ge: ("ge", ">=", operator.ge), Gt: ("gt", ">", operator.gt), Le: ("le", "<=", operator.le),
    Lt: ("lt", "<", operator.lt)}


class Filled(NamedTuple):
    values: dict[str, Any]          # values of the fields that are given without mistakes
    complete: bool                  # False if there was a mistake
    made: Any = None                # instance of the class with these values


class TableReader:
    def __init__(self, problems: Problems, folder: Path) -> None:
        self.problems = problems
        self.folder = folder

    def read(self, shape: Shape, table: Any, place: Place, besides: Iterable[str] = (),
             cls: Callable[..., Any] | None = None) -> Filled:
        """Return the values of the fields in `table`, and the instance that `cls` makes of them if all are right.

        `besides` are other keys that the table may have, which the caller reads.
        """
        before = self.problems.found
        if not isinstance(table, dict):
            self.problems.add(place, "expected a table", table)
            return Filled({}, False)
        values: dict[str, Any] = {}
        written: dict[str, str] = {}        # field -> the key that its author chose
        for key, value in table.items():
            here = (*place, key)
            if key not in shape.field_of:
                known = [*shape.field_of, *besides]
                self.problems.add(here, f"unknown key; {near(key, known)}", value)
                if (guess := nearest(key, known)) in shape.field_of:
                    written.setdefault(shape.field_of[guess][0], key)
                continue
            name, unit = shape.field_of[key]
            if written.get(name) in shape.field_of:
                self.problems.add(here, f"the same as {written[name]}, which is given too; keep one", value)
                continue
            written[name] = key
            if (found := self.value(shape.hints[name], value, here, unit)) is not WRONG:
                values[name] = found
        for name in (name for name in shape.hints if name in shape.required and name not in written):
            keys = list(spellings(name) or [name])
            remedy = f"; write it in one of {', '.join(keys)}" if len(keys) > 1 else ""
            self.problems.add((*place, keys[0]), f"is missing{remedy}")
        if cls is None or self.problems.found > before:
            return Filled(values, self.problems.found == before)
        try:
            return Filled(values, True, cls(**values))
        except (ValueError, AssertionError, OSError) as error:
            refuse(error, table, place, self.problems)
            return Filled(values, False)

    def value(self, hint: Any, written: Any, place: Place, unit: str = "") -> Any:
        """Return `written` as a value of the type `hint`, or WRONG; a number is a time in `unit`, if that is not ""."""
        value = written
        if unit and not isinstance(written, list | dict):
            try:
                value = to_ns(written, unit)
            except ValueError as error:
                return self._wrong(place, str(error), written)
        origin, parts = get_origin(hint), get_args(hint)
        if NONE in parts and len(parts) == 2 and value is not None:
            hint = parts[0] if parts[1] is NONE else parts[1]
            origin, parts = get_origin(hint), get_args(hint)
        if origin is Annotated:
            return self._annotated(parts[0], parts[1:], written, place, unit)
        if origin in (Union, types.UnionType):
            return self._one_of(parts, written, place, unit)
        if hint is Any and not (unit and isinstance(value, list)):
            return value
        if origin is Literal:
            return self._choice({part: part for part in parts}, value, written, place)
        if origin in LISTS or hint in LISTS or hint is Any:
            return self._list(list if hint is Any else origin or hint, parts, written, place, unit)
        if hint is dict or (origin in (dict, Mapping) and parts[0] is str):
            if not isinstance(written, dict):
                return self._wrong(place, "expected a table", written)
            found = {key: self.value(parts[1] if parts else Any, part, (*place, key), unit)
                     for key, part in written.items()}
            return WRONG if any(part is WRONG for part in found.values()) else found
        if not isinstance(hint, type):
            return self._foreign(hint, written, place)
        if is_dataclass(hint):
            filled = self.read(shape_of(hint), written, place, (), hint)
            return filled.made if filled.complete else WRONG
        if issubclass(hint, Enum):
            return self._choice({member.value: member for member in hint}, value, written, place)
        if hint is int:
            return value if type(value) is int else self._wrong(place, "expected a whole number", written)
        if hint is float:
            return float(value) if type(value) in (int, float) else self._wrong(place, "expected a number", written)
        if hint is bool:
            return value if type(value) is bool else self._wrong(place, "expected true or false", written)
        if hint in (str, Path):
            if type(value) is not str:
                return self._wrong(place, "expected text in quotes", written)
            from_folder = value and (hint is Path or place[-1] == "file")
            return hint(self.folder / value if from_folder else value)
        return self._foreign(hint, value, place)

    def _wrong(self, place: Place, rule: str, *value: Any) -> Any:
        self.problems.add(place, rule, *value)
        return WRONG

    def _foreign(self, hint: Any, value: Any, place: Place) -> Any:
        found, complaints = judge(hint, value)
        for within, rule, part in complaints:
            self.problems.add((*place, *within), rule, part)
        return WRONG if complaints else found

    def _annotated(self, hint: Any, grouped: Sequence[Any], written: Any, place: Place, unit: str) -> Any:
        marks = [mark for group in grouped for mark in (group if isinstance(group, GroupedMetadata) else (group,))]
        if len(marks) == 1 and isinstance(marks[0], ToldApartBy):
            return self._told_apart(get_args(hint), marks[0].key, written, place)
        if not all(type(mark) in LIMITS for mark in marks):
            return self._foreign(Annotated[hint, *marks], written, place)
        found = self.value(hint, written, place, unit)
        for mark in marks if found is not WRONG else ():
            attribute, sign, holds = LIMITS[type(mark)]
            limit = getattr(mark, attribute)
            if not holds(found, limit):
                return self._wrong(place, f"expected {sign} {limit:g}", written)
        return found

    def _choice(self, allowed: Mapping[Any, Any], value: Any, written: Any, place: Place) -> Any:
        for one, meaning in allowed.items():
            if type(one) is type(value) and one == value:
                return meaning
        texts = [repr(one) for one in allowed]
        rule = " or ".join([", ".join(texts[:-1]), texts[-1]] if len(texts) > 1 else texts)
        guess = nearest(written, [one for one in allowed if isinstance(one, str)])
        remedy = f"; did you mean {value_text(guess)}?" if guess else ""
        return self._wrong(place, f"expected {rule}{remedy}", written)

    def _list(self, kind: Any, parts: Sequence[Any], value: Any, place: Place, unit: str) -> Any:
        if not isinstance(value, list):
            return self._wrong(place, "expected a list", value)
        hints = parts or (Any,)
        if kind is tuple and parts and parts[-1] is not Ellipsis:
            if len(value) != len(parts):
                bound = "least" if len(value) < len(parts) else "most"
                return self._wrong(place, f"expected at {bound} {len(parts)} entries, found {len(value)}", value)
        else:
            hints = [hints[0]] * len(value)
        found = [self.value(hint, part, (*place, index), unit)
                 for index, (hint, part) in enumerate(zip(hints, value, strict=True))]
        return WRONG if any(part is WRONG for part in found) else LISTS[kind](found)

    def _told_apart(self, members: Sequence[type], key: str, table: Any, place: Place) -> Any:
        if not isinstance(table, dict):
            return self._wrong(place, "expected a table", table)
        by_tag = {tag: member for member in members for tag in get_args(shape_of(member).hints[key])}
        tag = table.get(key)
        if isinstance(tag, str) and tag in by_tag:
            owners = {name: owner for owner, member in by_tag.items() for name in shape_of(member).field_of}
            strange = [name for name in table if name in owners and name not in shape_of(by_tag[tag]).field_of]
            for name in strange:
                remedy = f"{key} = {value_text(owners[name])} has it"
                self.problems.add((*place, name), f"unknown key; {remedy}", table[name])
            found = self.value(by_tag[tag], {name: table[name] for name in table if name not in strange}, place)
            return WRONG if strange else found
        if key in table:
            self.problems.add((*place, key), f"no such {key}; {near(tag, by_tag)}", tag)
        else:
            self.problems.add((*place, key), "is missing")
        self.read(shape_of(_best_fit(members, table)), table, place)       # adds the other mistakes of the table
        return WRONG

    def _one_of(self, hints: Sequence[Any], written: Any, place: Place, unit: str) -> Any:
        """Return `written` as the type that accepts it; of several, as one that does not change its type."""
        members = [hint for hint in hints if hint is not NONE]
        if written is None and NONE in hints:
            return None
        classes = [member for member in members if isinstance(member, type) and is_dataclass(member)]
        if classes and isinstance(written, dict):
            return self.value(_best_fit(classes, written), written, place)
        if Path in members and isinstance(written, str) and written:
            written = str(self.folder / written)
        tried: list[_Tried] = []
        accepted: list[Any] = []
        for member in members:
            tried.append(_Tried())
            found = TableReader(tried[-1], self.folder).value(member, written, place, unit)
            if found is not WRONG:
                accepted.append(found)
        if accepted:
            return next((found for found in accepted if type(found) is type(written)), accepted[0])
        _add_any_of(tried, self.problems)
        return WRONG


class _Tried(Problems):
    """Collects the problems of a value with one member of a union, as another member may accept it."""

    def __init__(self) -> None:
        super().__init__("")
        self.added: list[tuple[Place, str, tuple[Any, ...]]] = []

    def add(self, place: Place, rule: str, *value: Any) -> None:
        self.found += 1
        self.added.append((place, rule, value))

    def say(self, line: str) -> None:
        self.found += 1
        self.lines.append(line)


def _add_any_of(tried: Iterable[_Tried], problems: Problems) -> None:
    """Add one problem for each place, "expected this or that"."""
    rules: dict[Place, list[str]] = {}
    values: dict[Place, tuple[Any, ...]] = {}
    for one in tried:
        for place, rule, value in one.added:
            rules.setdefault(place, []).append(rule)
            values[place] = value
        for line in one.lines:
            problems.say(line)
    for place, said in rules.items():
        parted = [rule.partition("; ") for rule in dict.fromkeys(said)]
        remedies = "".join(semicolon + remedy for _, semicolon, remedy in parted)
        problems.add(place, " or ".join(rule for rule, _, _ in parted).replace(" or expected ", " or ") + remedies,
                     *values[place])


def _best_fit(classes: Sequence[type], table: Mapping[str, Any]) -> type:
    """Return the class that a table is meant for: by its `kind`, or by the number of keys that fit."""
    def fit(cls: type) -> tuple[bool, int, int]:
        shape = shape_of(cls)
        kind = shape.hints.get("kind")
        says_so = get_origin(kind) is Literal and table.get("kind") in get_args(kind)
        return says_so, len(set(shape.field_of) & set(table)), -len(shape.required)

    return max(classes, key=fit)
