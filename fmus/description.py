"""The description of an FMU as plain data: read once with FMPy (`fmus/describe_fmu.py`), sent to processes as JSON."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from itertools import product
from math import prod
from typing import Literal

import msgspec

from fmus.errors import PlantError


def element_names(name: str, shape: Iterable[int]) -> list[str]:
    """Return the names of an array's elements, "A[1,1]" first, last index fastest; of a scalar its own name."""
    return [name + (f"[{','.join(map(str, index))}]" if index else "")
            for index in product(*(range(1, extent + 1) for extent in shape))]


class Clock(msgspec.Struct, frozen=True):
    """The attributes of a clock of FMI 3.0; interval and shift are fractions of a second, (numerator, denominator)."""

    variability: str                # constant, fixed, calculated, tunable, changing, countdown, triggered
    interval: tuple[int, int] | None = None         # of a constant clock; None: the FMU tells it
    shift: tuple[int, int] = (0, 1)                 # instant of the first tick
    fraction: bool = False          # the FMU tells intervals as counter and resolution


class BusTerminal(msgspec.Struct, frozen=True):
    """The names of the four variables by which an FMU is on a bus (FMI-LS-BUS 1.0, low cut)."""

    name: str
    tx_data: str
    tx_clock: str
    rx_data: str
    rx_clock: str


class Variable(msgspec.Struct, frozen=True):
    name: str
    reference: int
    type: str                       # as in the XML: Real, Integer, ... (FMI 2.0), Float64, Int32, ... (3.0)
    causality: str
    variability: str
    initial: str | None             # exact, approx, calculated
    unit: str | None
    start: str | None               # as in the XML
    about: str
    elements: int = 1               # number of elements: the product of `shape`
    min: float | None = None        # lowest start value, itself allowed; None: no bound
    max: float | None = None        # highest start value, itself allowed; None: no bound
    shape: tuple[int, ...] = ()     # extents of an array, rows first; () for a scalar
    sizes: tuple[str, ...] = ()     # for each extent of `shape` the structural parameter that sets it, or ""
    items: dict[str, int] = {}      # number of each item of an enumeration, by name
    most_bytes: int | None = None   # largest size of a binary value; None: no bound
    mime_type: str = ""             # of a binary variable
    clock: Clock | None = None      # of a variable of type Clock
    clocks: tuple[int, ...] = ()    # references of the clocks at whose ticks the variable has a value

    @property
    def is_float64(self) -> bool:
        return self.type in ("Real", "Float64") and not self.shape

    @property
    def settable_at_start(self) -> bool:
        return self.causality == "input" or (self.variability != "constant" and self.initial in ("exact", "approx"))

    @property
    def settable_while_stepping(self) -> bool:
        return self.causality == "input" or (self.causality == "parameter" and self.variability == "tunable")

    def resized(self, sizes: Mapping[str, int]) -> Variable:
        """Return the variable with the extents that `sizes`, values of structural parameters by name, set."""
        if not any(name in sizes for name in self.sizes):
            return self
        shape = tuple(sizes.get(name, extent) for name, extent in zip(self.sizes, self.shape, strict=True))
        return msgspec.structs.replace(self, shape=shape, elements=prod(shape))


class PlantDescription(msgspec.Struct, frozen=True):
    file: str                       # path of the archive, for error messages
    fmi: Literal["2.0", "3.0"]
    model_name: str
    about: str
    token: str                      # GUID (2.0) or instantiation token (3.0)
    binary: str
    resources: str                  # unpacked folder, which may be missing
    variable_step: bool             # canHandleVariableCommunicationStepSize
    fixed_step_s: float | None      # step [s] of which communication points are multiples, if the description has one
    once_per_process: bool          # canBeInstantiatedOnlyOncePerProcess
    ours: bool                      # made by fmus/describe.py: the FMU refuses non-finite values, ends no step early
    saves_state: bool               # canGetAndSetFMUState and canSerializeFMUState
    log_formatter: str | None       # library that expands the printf arguments of FMI 2.0 messages
    variables: dict[str, Variable]
    event_mode: bool = False        # hasEventMode
    bus_terminals: tuple[BusTerminal, ...] = ()
    bus_terminals_problem: str = ""     # why a bus terminal that the FMU declares cannot be used

    def variable(self, name: str, unit: str | None = None) -> Variable:
        """Return the variable `name`; raises PlantError if there is none or its unit is not `unit`, where given."""
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
