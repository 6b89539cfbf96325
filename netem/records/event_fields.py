"""The detail of an event as named values, which tables and views of a run read back.

    target=target_1 number=2 x_m=2.067 y_m=3.893
    target=target_1 corners_m=1,1;4,1;4,3

A value is a number, a word, a text in quotation marks, or corners: pairs x,y between semicolons. A name that ends in a
unit, as in `way_m`, says that of its value. Three names have a meaning of their own:

    x_m, y_m    place of the event in the plane
    corners_m   polygon in the plane, from the event on until the next of the same node, kind and first value, or until
                the event of that node whose kind is the same with " over" at its end
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from math import isfinite
from typing import Final

Place = tuple[float, float]
Value = float | str | list[Place]

X, Y, CORNERS = "x_m", "y_m", "corners_m"
OVER: Final = " over"           # after the kind of an event that drew a polygon: the polygon is there no more
NAME: Final = re.compile(r"[A-Za-z]\w*")
_FIELD: Final = re.compile(r'([A-Za-z]\w*)=("(?:[^"\\]|\\.)*"|[^\s"]+)')
_PLAIN: Final = re.compile(r'[^\s"=]+')


def written(fields: Mapping[str, Value]) -> str:
    """Return the detail of an event, numbers to 6 digits; ValueError for a name that is none."""
    if wrong := [name for name in fields if NAME.fullmatch(name) is None]:
        raise ValueError(f"{wrong[0]!r}: expected letters, digits and _, a letter first")
    return " ".join(f"{name}={_text(value)}" for name, value in fields.items())


def read(detail: str) -> dict[str, str] | None:
    """Return the values by name as they are written, without quotation marks; None if the detail has another form."""
    fields: dict[str, str] = {}
    at = 0
    while found := _FIELD.match(detail, at):
        name, value = found.groups()
        try:
            fields[name] = json.loads(value) if value.startswith('"') else value
        except ValueError:
            return None
        at = found.end()
        if at == len(detail):
            return fields
        if detail[at] != " ":
            return None
        at += 1
    return None


def place(fields: Mapping[str, str]) -> Place | None:
    """Return the place of an event [m], None if it has none."""
    return _place(fields.get(X, ""), fields.get(Y, ""))


def corners(fields: Mapping[str, str]) -> list[Place]:
    """Return the corners [m] of the polygon of an event, [] if it has none."""
    found = []
    for pair in fields.get(CORNERS, "").split(";"):
        x, _, y = pair.partition(",")
        if (corner := _place(x, y)) is None:
            return []
        found.append(corner)
    return found


def _place(x: str, y: str) -> Place | None:
    try:
        found = float(x), float(y)
    except ValueError:
        return None
    return found if all(map(isfinite, found)) else None


def _text(value: Value) -> str:
    if isinstance(value, str):
        return value if _PLAIN.fullmatch(value) else json.dumps(value)
    if isinstance(value, list):
        return ";".join(f"{x:.6g},{y:.6g}" for x, y in value) or '""'
    return f"{value:.6g}"
