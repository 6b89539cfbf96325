"""What a host has to know of an FMU, as plain data: read once where FMPy is at hand, sent to processes as JSON."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Literal

import msgspec

from fmus.errors import PlantError


class Variable(msgspec.Struct, frozen=True):
    name: str
    reference: int
    type: str                       # as the XML writes it: Real, Integer, ... (2.0), Float64, Int32, ... (3.0)
    causality: str
    variability: str
    initial: str | None             # exact, approx, calculated
    unit: str | None
    start: str | None               # as the XML writes it
    about: str
    elements: int = 1               # of an array, at its declared size

    @property
    def is_float64(self) -> bool:
        return self.type in ("Real", "Float64") and self.elements == 1

    @property
    def settable_at_start(self) -> bool:
        return self.causality == "input" or (self.variability != "constant" and self.initial in ("exact", "approx"))

    @property
    def settable_while_stepping(self) -> bool:
        return self.causality == "input" or (self.causality == "parameter" and self.variability == "tunable")


class PlantDescription(msgspec.Struct, frozen=True):
    file: str                       # the archive, for messages
    fmi: Literal["2.0", "3.0"]
    model_name: str
    about: str
    token: str                      # GUID (2.0) or instantiation token (3.0)
    binary: str
    resources: str                  # unpacked folder; it need not exist
    variable_step: bool             # canHandleVariableCommunicationStepSize
    fixed_step_s: float | None      # where variable_step is false: the step that the description names
    once_per_process: bool
    log_formatter: str | None       # library that expands the printf arguments of FMI 2.0 messages
    variables: dict[str, Variable]

    def variable(self, name: str, unit: str | None = None) -> Variable:
        """Look up a variable; `unit`, if given, has to be the one that the FMU declares."""
        found = self.variables.get(name)
        if found is None:
            raise PlantError(f"{self.file}: {name}: no such variable{self._nearest(name)}")
        if unit is not None and unit != found.unit:
            raise PlantError(f"{self.file}: {name}: unit {unit!r} asked for, but the FMU declares "
                             f"{found.unit!r}: convert the value and state the FMU's unit")
        return found

    def names(self, causality: str) -> list[str]:
        return [name for name, variable in self.variables.items() if variable.causality == causality]

    def _nearest(self, name: str) -> str:
        near: Iterable[str] = get_close_matches(name, self.variables, n=3, cutoff=0.5)
        near = near or [each for each in self.variables if each.partition("[")[0] == name.partition("[")[0]][:3]
        if near:
            return f"; nearest names: {', '.join(near)}"
        some = list(self.variables)[:8]
        return f"; it has {', '.join(some)}" + (", ..." if len(self.variables) > len(some) else "")
