"""Expands nested lists of a scenario to scalar variables of an FMU: {"A": [[-3, 1]]} -> {"A[1,1]": -3, "A[1,2]": 1}."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

from fmus.errors import PlantError

Value: TypeAlias = float | bool | str
Nested: TypeAlias = Value | Sequence["Nested"]


def expand_parameters(values: Mapping[str, Nested]) -> dict[str, Value]:
    """Return one value per scalar, named as FMI's structured naming has it: rows first, indices from 1.

    A value that is no list keeps its name. Raises PlantError for an empty list or rows of different lengths."""
    flat: dict[str, Value] = {}
    for name, value in values.items():
        if isinstance(value, str) or not isinstance(value, Sequence):
            flat[name] = value
        else:
            _shape(name, value)
            _expand(name, (), value, flat)
    return flat


def _expand(name: str, index: tuple[int, ...], value: Nested, flat: dict[str, Value]) -> None:
    if isinstance(value, Sequence) and not isinstance(value, str):
        for place, element in enumerate(value, start=1):
            _expand(name, (*index, place), element, flat)
    else:
        flat[f"{name}[{','.join(map(str, index))}]"] = value


def _shape(name: str, value: Nested) -> tuple[int, ...]:
    if isinstance(value, str) or not isinstance(value, Sequence):
        return ()
    if not value:
        raise PlantError(f"{name}: an empty list: leave the key out to keep the FMU's start value")
    shapes = [_shape(name, element) for element in value]
    if len(set(shapes)) > 1:
        raise PlantError(f"{name}: its rows differ in length: a matrix is a list of rows of equal length")
    return (len(value), *shapes[0])
