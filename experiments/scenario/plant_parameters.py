"""Which start values a plant gets: those of a preset, then from a table of the team's knowledge, then the agent's own.

A key is a variable or, as a nested list, a matrix of them: `A = [[-3, 1], [2, -1]]` is A[1,1], A[1,2], A[2,1], A[2,2].
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from experiments.scenario.problems import near
from fmus.bounds import outside
from fmus.errors import PlantError
from fmus.parameters import expand_parameters


class StartValue(NamedTuple):
    fmi_type: str = "Float64"
    elements: int = 1                   # of an array
    min: float | None = None
    max: float | None = None


@dataclass(frozen=True)
class PlantNames:
    """What can be set before the first step, by variable. `fmu` is an own model or an absolute path."""

    fmu: str
    parameters: Mapping[str, StartValue]
    others: Mapping[str, StartValue]    # inputs, initial values
    presets: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    outputs: tuple[str, ...] = ()

    def over_preset(self, preset: str | None, given: Mapping[str, Any]) -> dict[str, Any]:
        """The values of a preset, `given` over them variable by variable; both are free of complaints."""
        if preset is None:
            return dict(given)
        said = set(expand_parameters(given))
        return {**{key: value for key, value in self.presets[preset].items() if key not in said}, **given}

    def taken_from(self, table: Mapping[str, Any]) -> dict[str, Any]:
        """The entries of a table that are parameters of this plant."""
        known = {base(name) for name in self.parameters} | set(self.parameters)
        return {key: value for key, value in table.items() if key in known}

    def complaint(self, key: str, value: Any) -> str:
        """What is wrong with a start value, "" if nothing."""
        types = {**self.others, **self.parameters}
        if key not in types and key not in {base(name) for name in types}:
            return f"no such parameter or start value; {near(key, dict.fromkeys(map(base, types)))}"
        if isinstance(value, dict):
            return "expected a number or lists of them"
        if key in types:
            return _misfit(types[key], value)
        try:
            elements = expand_parameters({key: value})
        except PlantError as error:
            return str(error).removeprefix(f"{key}: ")
        for name, element in elements.items():
            if name not in types:
                largest = [other for other in types if base(other) == key][-1]
                return f"the model has no {name}; {key} ends with {largest}"
            if problem := _misfit(types[name], element):
                return f"{name}: {problem}"
        return ""


def base(name: str) -> str:
    return name.partition("[")[0]


_IS: Mapping[str, tuple[str, Callable[[Any], bool]]] = {
    "Boolean": ("true or false", lambda value: isinstance(value, bool)),
    "String": ("text in quotes", lambda value: isinstance(value, str)),
    "whole": ("a whole number", lambda value: isinstance(value, int) and not isinstance(value, bool)),
    "number": ("a number", lambda value: isinstance(value, int | float) and not isinstance(value, bool)),
}


def _misfit(wanted: StartValue, value: Any) -> str:
    whole = "Int" in wanted.fmi_type or wanted.fmi_type == "Enumeration"
    words, fits = _IS.get(wanted.fmi_type, _IS["whole" if whole else "number"])
    values = _flat(value)
    if len(values) != wanted.elements or (wanted.elements == 1 and isinstance(value, list)):
        return f"expected {words}" if wanted.elements == 1 else f"expected {wanted.elements} values"
    if not all(map(fits, values)):
        return f"expected {words}"
    wrong = (outside(each, wanted.min, wanted.max) for each in values if not isinstance(each, str))
    return next(filter(None, wrong), "")


def _flat(value: Any) -> list[Any]:
    return [leaf for part in value for leaf in _flat(part)] if isinstance(value, list) else [value]
