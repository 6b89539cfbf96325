"""Presets: named start values of a model, in the file presets.toml of its folder.

    [p3at]
    about = "Pioneer P3-AT: four wheels, skid steering"
    parameters = { wheel_radius_m = 0.11, track_m = 0.573 }

The loader applies them; no preset is part of the FMU, so a changed preset rebuilds nothing.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmus.bounds import outside
from fmus.describe import Model
from fmus.errors import PlantError
from fmus.parameters import Value, expand_parameters


@dataclass(frozen=True)
class Preset:
    about: str
    parameters: dict[str, Value]        # by scalar variable


def read_presets(folder: Path, model: Model) -> dict[str, Preset]:
    """Return the presets of the model in `folder`, by name; {} without presets.toml.

    Raises one PlantError with a line for each problem."""
    file = folder / "presets.toml"
    if not file.is_file():
        return {}
    try:
        tables = tomllib.loads(file.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise PlantError(f"{file}: not valid TOML: {error}") from None
    problems: list[str] = []
    presets = {name: _preset(name, table, model, problems) for name, table in tables.items()}
    if problems:
        raise PlantError("\n".join(f"{file}: {problem}" for problem in problems))
    return presets


def _preset(name: str, table: Any, model: Model, problems: list[str]) -> Preset:
    if not isinstance(table, dict) or not isinstance(table.get("parameters"), dict):
        problems.append(f"{name}: expected a table with about and parameters = {{ variable = value }}")
        return Preset("", {})
    if unknown := set(table) - {"about", "parameters"}:
        problems.append(f"{name}: unknown keys {', '.join(sorted(unknown))}")
    about = table.get("about")
    if not isinstance(about, str) or not about:
        problems.append(f"{name}.about: say in a few words what it is")
    try:
        values = expand_parameters(table["parameters"])
    except PlantError as error:
        problems.append(f"{name}.parameters.{error}")
        values = {}
    scalars = {scalar.name: scalar for scalar in model.scalars() if not scalar.computed}
    for variable, value in values.items():
        if variable not in scalars:
            problems.append(f"{name}.parameters.{variable}: {model.name} has no such variable to set")
        elif isinstance(value, bool) or not isinstance(value, int | float):
            problems.append(f"{name}.parameters.{variable}={value!r}: expected a number")
        elif problem := outside(value, scalars[variable].min, scalars[variable].max):
            problems.append(f"{name}.parameters.{variable}={value}: {problem}")
    return Preset(str(about), values)
