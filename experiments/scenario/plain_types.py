"""Tables whose values obviously have the right types, without pydantic: most of a correct scenario is of this kind.

`plain_values` accepts or gives up; it never says what is wrong. What it gives up on, a mistake or an unusual type hint,
goes to pydantic (`table_types`), which judges every table that is in doubt. Both give equal values where both accept.
"""

from __future__ import annotations

import types
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from math import isfinite
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt

from experiments.scenario.shape import Shape, shape_of
from netem.topology.told_apart import ToldApartBy


class NotPlain(Exception):
    """The value may be wrong, or its type hint is none that this module knows."""


def plain_values(shape: Shape, ready: Mapping[str, Any]) -> dict[str, Any] | None:
    """The values of a prepared table, or None where pydantic has to look at it."""
    try:
        return {name: _plain(shape.hints[name], value) for name, value in ready.items()}
    except (NotPlain, KeyError):
        return None


def _plain(hint: Any, value: Any) -> Any:
    exact = _EXACT.get(hint) if isinstance(hint, type) else None
    if exact is not None:
        return exact(value)
    if hint is Any:
        return value
    origin, parts = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return _annotated(parts[0], parts[1:], value)
    if origin in (Union, types.UnionType):
        return _one_of(parts, value)
    if origin is Literal:
        return _literal(parts, value)
    if origin in (list, Sequence) and isinstance(value, list):
        return [_plain(parts[0], part) for part in value]
    if origin is tuple and isinstance(value, list):
        return _tuple(parts, value)
    if origin in (dict, Mapping) and parts[0] is str and isinstance(value, dict):
        return {key: _plain(parts[1], part) for key, part in value.items()}
    if isinstance(hint, type) and is_dataclass(hint) and isinstance(value, dict):
        return _instance(hint, value)
    raise NotPlain


def _int(value: Any) -> int:
    if type(value) is not int:
        raise NotPlain
    return value


def _float(value: Any) -> float:
    if type(value) not in (int, float) or not isfinite(value):
        raise NotPlain
    return float(value)


def _of_type(wanted: type) -> Callable[[Any], Any]:
    def check(value: Any) -> Any:
        if type(value) is not wanted:
            raise NotPlain
        return value

    return check


_EXACT: Final[Mapping[type, Callable[[Any], Any]]] = {
    int: _int, float: _float, str: _of_type(str), bool: _of_type(bool), dict: _of_type(dict)}


def _annotated(hint: Any, marks: Sequence[Any], value: Any) -> Any:
    if len(marks) == 1 and isinstance(marks[0], ToldApartBy):
        return _told_apart(get_args(hint), marks[0].key, value)
    found = _plain(hint, value)
    for mark in marks:
        inside = (found >= mark.ge if isinstance(mark, Ge) else found > mark.gt if isinstance(mark, Gt) else
                  found <= mark.le if isinstance(mark, Le) else found < mark.lt if isinstance(mark, Lt) else False)
        if not inside:
            raise NotPlain
    return found


def _told_apart(members: Sequence[Any], key: str, value: Any) -> Any:
    if isinstance(value, dict):
        for member in members:
            if value.get(key) in get_args(shape_of(member).hints[key]):
                return _plain(member, value)
    raise NotPlain


def _one_of(members: Sequence[Any], value: Any) -> Any:
    """Only unions in which at most one member can hold the value: None and one other."""
    others = [member for member in members if member is not type(None)]
    if value is None and len(others) < len(members):
        return None
    if len(others) != 1:
        raise NotPlain
    return _plain(others[0], value)


def _literal(allowed: Sequence[Any], value: Any) -> Any:
    if not any(type(value) is type(one) and value == one for one in allowed):
        raise NotPlain
    return value


def _tuple(parts: Sequence[Any], value: Sequence[Any]) -> tuple[Any, ...]:
    if len(parts) == 2 and parts[1] is Ellipsis:
        return tuple(_plain(parts[0], part) for part in value)
    if len(parts) != len(value):
        raise NotPlain
    return tuple(_plain(part, found) for part, found in zip(parts, value, strict=True))


def _instance(cls: type, table: Mapping[str, Any]) -> Any:
    """An instance of a dataclass; what its own rules refuse, pydantic says at its place."""
    hints = shape_of(cls).hints
    own = {item.name for item in fields(cls) if item.init}
    must = {item.name for item in fields(cls) if item.init and item.default is MISSING
            and item.default_factory is MISSING}
    if not must <= table.keys() <= own & hints.keys():
        raise NotPlain
    values = {name: _plain(hints[name], value) for name, value in table.items()}
    try:
        return cls(**values)
    except (ValueError, AssertionError, OSError):
        raise NotPlain from None
