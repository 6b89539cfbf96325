"""Lists all mistakes in the keys and types of a `[team]` table: unknown or missing keys, wrong types of values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import Enum
from typing import Any, Literal, get_args, get_origin

import msgspec

from netem.core.nearest import did_you_mean

LONGEST_VALUE = 60


def mistakes(table: Mapping[str, Any], kind: type[msgspec.Struct], place: str) -> Iterator[str]:
    """Yield the reasons why `table` is no `kind`, also those in its tables and lists of tables; `place` names it."""
    fields = {field.name: field for field in msgspec.structs.fields(kind)}
    for key, value in table.items():
        if key not in fields:
            remedy = did_you_mean(key, fields, "there are " + ", ".join(fields), quote='"{}"'.format)
            yield f"{place}.{key}={_text(value)}: unknown key; {remedy}"
            continue
        for at, part, part_kind in _parts(f"{place}.{key}", value, fields[key].type):
            if isinstance(part_kind, type) and issubclass(part_kind, msgspec.Struct) and isinstance(part, Mapping):
                yield from mistakes(part, part_kind, at)
                continue
            try:
                msgspec.convert(part, part_kind)
            except msgspec.ValidationError as error:
                yield f"{at}={_text(part)}: {_rule(part_kind, error)}"
    for name, field in fields.items():
        if field.required and name not in table:
            yield f"{place}.{name}: is missing"


def _parts(place: str, value: Any, kind: Any) -> Iterator[tuple[str, Any, Any]]:
    """Yield (place, value, kind) of the tables in `value`, or of the value itself."""
    inner = get_args(kind)[-1] if get_args(kind) else None
    if get_origin(kind) is dict and isinstance(value, Mapping):
        yield from ((f"{place}.{key}", part, inner) for key, part in value.items())
    elif get_origin(kind) is list and isinstance(value, list) and isinstance(inner, type) and issubclass(
            inner, msgspec.Struct):
        yield from ((f"{place}[{index}]", part, inner) for index, part in enumerate(value))
    else:
        yield place, value, kind


def _rule(kind: Any, error: msgspec.ValidationError) -> str:
    if get_origin(kind) is Literal:
        return "expected one of " + ", ".join(map(str, get_args(kind)))
    if isinstance(kind, type) and issubclass(kind, Enum):
        return "expected one of " + ", ".join(str(member.value) for member in kind)
    told = str(error).replace("`", "")
    return told[0].lower() + told[1:].replace(" - at $", ", at ")


def _text(value: Any) -> str:
    text = repr(value).replace("'", '"')
    return text if len(text) <= LONGEST_VALUE else text[:LONGEST_VALUE - 3] + "..."
