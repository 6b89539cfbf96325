"""The start values of a plant: those of a preset, replaced by those of a table, replaced by the agent's own.

A key is a variable or, with a nested list, a matrix of them: `A = [[-3, 1], [2, -1]]` is A[1,1], A[1,2], A[2,1],
A[2,2]. `fmus/start_values.py` has the rules of the types, which the plant itself uses too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from experiments.scenario.files_there import near_file, plants_in
from experiments.scenario.problems import near
from fmus.bounds import outside
from fmus.build import build_model, model_folder, own_models
from fmus.describe import read_model, variables_of
from fmus.describe_fmu import describe
from fmus.description import Variable
from fmus.errors import PlantError
from fmus.parameters import expand_parameters
from fmus.presets import read_presets
from fmus.start_values import REALS, Misfit, elements_of, kind_in_words, start_values

PARAMETERS: Final = ("parameter", "structuralParameter")


@dataclass(frozen=True)
class PlantNames:
    """The variables and presets that a scenario may name of a plant; `fmu` is an own model or an absolute path."""

    fmu: str
    variables: Mapping[str, Variable]
    presets: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    variable_step: bool = True
    fixed_step_s: float | None = None   # step that the FMU's description names

    @property
    def outputs(self) -> tuple[str, ...]:
        """The outputs that a medium can read as a pose: scalars of 64-bit floating point."""
        return tuple(name for name, variable in self.variables.items()
                     if variable.causality == "output" and variable.is_float64)

    def over_preset(self, preset: str | None, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return the values of a preset, replaced by `given` variable by variable; neither has problems."""
        if preset is None:
            return dict(given)
        said = set(expand_parameters(given))
        return {**{key: value for key, value in self.presets[preset].items() if key not in said}, **given}

    def taken_from(self, table: Mapping[str, Any]) -> dict[str, Any]:
        """Return the entries of a table that are parameters of this plant."""
        parameters = {name for name, variable in self.variables.items() if variable.causality in PARAMETERS}
        return {key: value for key, value in table.items() if key in parameters or key in self.parameters}

    @property
    def parameters(self) -> list[str]:
        """The names of the parameters without their indices: A for A[1,1] and A[1,2]."""
        return list(dict.fromkeys(base(name) for name, variable in self.variables.items()
                                  if variable.causality in PARAMETERS))

    def complaints(self, given: Mapping[str, Any]) -> dict[str, str]:
        """Return the problems of the start values, by key."""
        settable = [name for name, variable in self.variables.items() if variable.settable_at_start]
        bases = list(dict.fromkeys(map(base, settable)))
        known = {*self.variables, *map(base, self.variables)}
        found = {key: f"no such parameter or start value; {near(key, bases)}" for key in given if key not in known}
        found |= {key: "expected a value or lists of them, no table" for key, value in given.items()
                  if key in known and isinstance(value, dict)}
        rest = {key: value for key, value in given.items() if key not in found}
        return found | start_values(self.variables, rest).complaints

    def refusal_of_change(self, variable: str, *, inputs_only: bool, scaled: bool, value: Any) -> str:
        """Return why a fault cannot change `variable` while the plant runs, "" if it can.

        With `scaled` the fault scales or shifts the value that it has; else `value` is the new one, None for any.
        """
        fitting = [name for name, each in self.variables.items()
                   if each.causality == "input" or (each.settable_while_stepping and not inputs_only)]
        found = self.variables.get(variable)
        what = "input" if inputs_only else "input or tunable parameter"
        if found is None:
            return f"no such {what} of {self.fmu}; {near(variable, fitting)}"
        if variable not in fitting:
            return (f"is {kind_in_words(found)}"
                    + (" that cannot be changed while the plant runs" if found.causality in PARAMETERS else "")
                    + f": expected an {what}; {near(variable, fitting)}")
        if found.shape:
            return "is an array: faults change scalars"
        if scaled:
            return "" if found.type in REALS else f"is of type {found.type}: give a value, not a factor or bias"
        try:
            element, = elements_of(found, value)
        except Misfit as misfit:
            return f"value {value!r}: {misfit}"
        if found.causality in PARAMETERS and isinstance(element, int | float) and (
                problem := outside(element, found.min, found.max)):
            return f"value {value!r}: {problem}"
        return ""

    def scalable(self) -> dict[str, bool]:
        """Return the scalars that a fault can scale while the plant runs, each with whether it is an input."""
        return {name: variable.causality == "input" for name, variable in self.variables.items()
                if not self.refusal_of_change(name, inputs_only=False, scaled=True, value=None)}

    def step_complaint(self, step_ns: int | None) -> str:
        """Return the problem of a step that is given or missing, "" if there is none."""
        if step_ns is None:
            return "" if self.variable_step or self.fixed_step_s is not None else (
                "is missing: the FMU takes only steps of one size (canHandleVariableCommunicationStepSize is not true) "
                "and its description names none; give the step that it was exported with")
        if step_ns < 1:
            return "expected a step above 0"
        if self.fixed_step_s is not None and step_ns != round(self.fixed_step_s * 1e9):
            return f"the FMU's description says a step of {self.fixed_step_s * 1e3:.9g} ms; leave the key out"
        return ""


def base(name: str) -> str:
    return name.partition("[")[0]


def plant_names(fmu: str, folder: Path) -> PlantNames:
    """Return the names of an own model from its tables, of a model folder by building it, of an FMU by reading it.

    Raises ValueError with the reason if there is no such plant or it cannot be read.
    """
    try:
        return _names_of(fmu, folder)
    except OSError as error:                # such as a name that is too long, or a folder without permission
        raise ValueError(f"cannot be read: {error.strerror or error}") from error


def _names_of(fmu: str, folder: Path) -> PlantNames:
    if "/" not in fmu and not fmu.endswith(".fmu") and not (folder / fmu / "variables.toml").is_file():
        if fmu not in own_models():
            raise ValueError(f"no such model; {near(fmu, own_models())} (or give the path of a .fmu)")
        return PlantNames(fmu, variables_of(read_model(model_folder(fmu) / "variables.toml")),
                          _presets(model_folder(fmu)))
    path = (folder / fmu).absolute()
    if not path.exists():
        raise ValueError(f"no such file; {near_file(fmu, plants_in(folder))}")
    try:
        archive = build_model(path) if path.is_dir() else path
        presets = _presets(path) if path.is_dir() else {}
        description = describe(archive)
    except PlantError as error:
        raise ValueError(str(error)) from error
    return PlantNames(str(archive), description.variables, presets, description.variable_step,
                      description.fixed_step_s)


def _presets(folder: Path) -> dict[str, dict[str, Any]]:
    model = read_model(folder / "variables.toml")
    return {name: dict(preset.parameters) for name, preset in read_presets(folder, model).items()}
