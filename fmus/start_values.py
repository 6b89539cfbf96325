"""Checks and converts the start values that a scenario gives, for every variable type of FMI 2.0 and 3.0.

    type of the variable                    value in the scenario
    Real, Float32, Float64                  a finite number
    Integer, Int8 ... Int64, UInt8 ...      a whole number within the range of the type
    Boolean                                 true or false
    Enumeration                             the number or the name of one of its items
    String                                  text
    Binary                                  text: two hexadecimal digits a byte, spaces allowed between bytes

An array takes one value for all of its elements, or nested lists of its shape, rows first. Structural parameters are
applied before all other values are checked, since they change the shapes of arrays. If the FMU has no array `A` but
scalars `A[1,1]` and `A[1,2]`, `A = [[1, 2]]` sets the scalars.

Not settable: clocks.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import isfinite, prod
from typing import Any, Final

from fmus.bounds import outside
from fmus.description import Variable
from fmus.errors import PlantError
from fmus.parameters import Nested, expand_parameters

MOST_ELEMENTS: Final = 1_000_000
REALS: Final = ("Real", "Float64", "Float32")
RANGES: Final[dict[str, tuple[int, int]]] = {
    "Integer": (-2**31, 2**31 - 1),
    **{f"Int{bits}": (-2**(bits - 1), 2**(bits - 1) - 1) for bits in (8, 16, 32, 64)},
    **{f"UInt{bits}": (0, 2**bits - 1) for bits in (8, 16, 32, 64)},
}


class Misfit(ValueError):
    """A value does not fit its variable; the text is the broken rule: `expected a whole number`."""


@dataclass(frozen=True)
class StartValues:
    """Start values after the check.

    - `variables`: all variables of the FMU, resized by the structural parameters given;
    - `values`: for each variable that is set, its elements, converted to its type;
    - `complaints`: for each key that the scenario gave wrongly, the broken rule.
    """

    variables: Mapping[str, Variable]
    values: dict[str, list[Any]] = field(default_factory=dict)
    complaints: dict[str, str] = field(default_factory=dict)


def start_values(variables: Mapping[str, Variable], given: Mapping[str, Nested]) -> StartValues:
    """Check and convert `given`; a key names a variable, or the common name `A` of scalars `A[1,1]`, `A[1,2]`.

    Raises nothing: all problems are in `complaints` of the result."""
    structural = {name: value for name, value in given.items()
                  if name in variables and variables[name].causality == "structuralParameter"}
    used = {name for variable in variables.values() for name in variable.sizes}
    sizes: dict[str, int] = {}
    complaints: dict[str, str] = {}
    for name, value in structural.items():
        try:
            size = next(iter(elements_of(variables[name], value)), None)
            if name in used and (not isinstance(size, int) or size < 1):
                raise Misfit("expected at least 1: it is the size of an array")
            if isinstance(size, int):
                sizes[name] = size
        except Misfit as misfit:
            complaints[name] = str(misfit)
    found = StartValues({name: variable.resized(sizes) for name, variable in variables.items()} if sizes else variables,
                        complaints=complaints)
    for name in sizes:
        large = [each for each in found.variables.values() if name in each.sizes and each.elements > MOST_ELEMENTS]
        if large:
            complaints[name] = (f"makes {large[0].name} an array of {large[0].elements} elements: at most "
                                f"{MOST_ELEMENTS} are held")
    for key, value in given.items():
        if key in complaints:
            continue
        try:
            found.values.update(_set(found.variables, key, value))
        except Misfit as misfit:
            complaints[key] = str(misfit)
    return found


def elements_of(variable: Variable, value: Any) -> list[Any]:
    """Return `value` as the elements of `variable`, rows first; raises Misfit for a wrong type, shape or range."""
    convert = _converter(variable)
    if isinstance(value, list | tuple):
        return list(map(convert, _flat(variable, value, variable.shape)))
    return [convert(value)] * prod(variable.shape)


def _set(variables: Mapping[str, Variable], key: str, value: Nested) -> dict[str, list[Any]]:
    if key in variables:
        return {key: _startable(variables[key], value)}
    if not isinstance(value, list | tuple):
        scalars = _scalars(variables, key)
        raise Misfit(f"expected a list: {key} stands for {scalars[0]} to {scalars[-1]}")
    try:
        elements = expand_parameters({key: value})
    except PlantError as error:
        _scalars(variables, key)
        raise Misfit(str(error).removeprefix(f"{key}: ")) from None
    values: dict[str, list[Any]] = {}
    for name, element in elements.items():
        if name not in variables:
            raise Misfit(f"the model has no {name}; {key} ends with {_scalars(variables, key)[-1]}; a larger plant is "
                         "a model folder of your own or an FMU")
        try:
            values[name] = _startable(variables[name], element)
        except Misfit as misfit:
            raise Misfit(f"{name}: {misfit}") from None
    return values


def _scalars(variables: Mapping[str, Variable], key: str) -> list[str]:
    """Return the variables with the common name `key`; raises Misfit if there are none."""
    scalars = [name for name in variables if name.startswith(f"{key}[")]
    if not scalars:
        raise Misfit("no such variable")
    return scalars


def _startable(variable: Variable, value: Any) -> list[Any]:
    if not variable.settable_at_start:
        raise Misfit(f"is {kind_in_words(variable)}: it has no start value to set")
    elements = elements_of(variable, value)
    if variable.min is not None or variable.max is not None:
        for element in elements:
            if isinstance(element, int | float) and (problem := outside(element, variable.min, variable.max)):
                raise Misfit(problem)
    return elements


def kind_in_words(variable: Variable) -> str:
    article = "an" if variable.causality[:1] in tuple("aeiou") else "a"
    return f"{article} {variable.causality}" + (" constant" if variable.variability == "constant" else "")


def _flat(variable: Variable, value: Any, shape: tuple[int, ...]) -> list[Any]:
    """Return the leaves of nested lists, rows first; raises Misfit unless the lists have the shape `shape`."""
    is_list = isinstance(value, list | tuple)
    if not shape and not is_list:
        return [value]
    if not shape or not is_list or len(value) != shape[0]:
        raise Misfit(_wanted(variable))
    return [leaf for part in value for leaf in _flat(variable, part, shape[1:])]


def _wanted(variable: Variable) -> str:
    """Return the rule for a value of the variable, in words: `expected a whole number`."""
    one = _words(variable)
    if not variable.shape:
        return f"expected {one}"
    extents = " x ".join(map(str, variable.shape))
    nested = "a list" if len(variable.shape) == 1 else "nested lists"
    return f"expected {one} for all elements, or {nested} of {extents}"


def _words(variable: Variable) -> str:
    if variable.type in REALS:
        return "a number"
    if variable.type in RANGES:
        return "a whole number"
    if variable.type == "Enumeration":
        items = ", ".join(f"{name} ({number})" for name, number in list(variable.items.items())[:12])
        more = ", ..." if len(variable.items) > 12 else ""
        return f"the number or name of an item: {items}{more}" if items else "a whole number"
    return {"Boolean": "true or false", "String": "text in quotes",
            "Binary": 'hexadecimal digits in quotes, two a byte: "00ff"'}.get(variable.type, "no value")


def _converter(variable: Variable) -> Callable[[Any], Any]:
    """Return the function that converts one element from the scenario's to the FMU's type; both raise Misfit."""
    by_type: dict[str, Callable[[Variable, Any], Any]] = {
        "Boolean": _boolean, "String": _string, "Binary": _binary, "Enumeration": _enumeration,
        **dict.fromkeys(REALS, _real), **dict.fromkeys(RANGES, _integer)}
    if variable.type not in by_type:
        raise Misfit(f"is of type {variable.type}, which takes no value")
    convert = by_type[variable.type]
    return lambda value: convert(variable, value)


def _real(variable: Variable, value: Any) -> float:
    if isinstance(value, bool | str | bytes | list | tuple | dict):
        raise Misfit(_wanted(variable))
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise Misfit(_wanted(variable)) from None
    except OverflowError:
        raise Misfit("expected a number of at most 1.8e308") from None
    if not isfinite(number):
        raise Misfit("a value must be finite")
    if variable.type == "Float32":
        try:
            struct.pack("<f", number)
        except OverflowError:
            raise Misfit("expected a number within the range of 32-bit floating point, +-3.4e38") from None
    return number


def _integer(variable: Variable, value: Any) -> int:
    number = _whole(variable, value)
    low, high = RANGES[variable.type]
    if not low <= number <= high:
        raise Misfit(f"expected {low} to {high}, the range of {variable.type}")
    return number


def _whole(variable: Variable, value: Any) -> int:
    try:
        if isinstance(value, bool):
            raise TypeError
        return int(value.__index__())
    except (AttributeError, TypeError):
        raise Misfit(_wanted(variable)) from None


def _enumeration(variable: Variable, value: Any) -> int:
    if isinstance(value, str):
        if value not in variable.items:
            raise Misfit(_wanted(variable))
        return variable.items[value]
    number = _whole(variable, value)
    if variable.items and number not in variable.items.values():
        raise Misfit(_wanted(variable))
    if not -2**63 <= number < 2**63:
        raise Misfit(f"expected {-2**63} to {2**63 - 1}")
    return number


def _boolean(variable: Variable, value: Any) -> bool:
    if not isinstance(value, bool):
        raise Misfit(_wanted(variable))
    return value


def _string(variable: Variable, value: Any) -> bytes:
    if not isinstance(value, str):
        raise Misfit(_wanted(variable))
    if "\0" in value:
        raise Misfit("expected text without the character U+0000, which ends a text of FMI")
    try:
        return value.encode()
    except UnicodeEncodeError:
        raise Misfit("expected text that UTF-8 can hold") from None


def _binary(variable: Variable, value: Any) -> bytes:
    if not isinstance(value, str | bytes):
        raise Misfit(_wanted(variable))
    try:
        data = bytes.fromhex(value) if isinstance(value, str) else value
    except ValueError:
        raise Misfit(_wanted(variable)) from None
    if variable.most_bytes is not None and len(data) > variable.most_bytes:
        raise Misfit(f"{len(data)} bytes: expected at most {variable.most_bytes}")
    return data
