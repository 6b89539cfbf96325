"""A plant: one FMU instance that is stepped lazily and exactly to the instants that matter.

Time is an int in nanoseconds; this package turns it into the float seconds of FMI, always from the integer, never by
adding steps up. Step sizes come from the integer difference, so equal steps are equal to the last bit.

*Invariants*
- `now_ns` is the instant that all values belong to; it moves only in `advance_to`.
- A value that is set acts from `now_ns` on: advance first, then set.
- After a failed step the plant refuses everything but `close`.

Needs only ctypes and msgspec: FMPy reads the description elsewhere (`fmus.describe_fmu`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from numbers import Integral, Real
from types import TracebackType
from typing import Any

from fmus.bounds import outside
from fmus.call_record import CallRecord
from fmus.description import PlantDescription, Variable
from fmus.errors import PlantError
from fmus.fmi_calls import FATAL, Fmu, Fmu2, Fmu3, status_name
from fmus.parameters import Nested, Value, expand_parameters

HALF_NS = 0.5e-9        # in seconds: half the resolution of simulated time

__all__ = ["InputGroup", "OutputGroup", "Plant", "PlantDescription", "PlantError", "expand_parameters"]


class InputGroup:
    """Inputs that are set together by one FMI call."""

    def __init__(self, plant: Plant, fmu: Fmu, variables: Sequence[Variable]) -> None:
        self.names = tuple(variable.name for variable in variables)
        self._set = fmu.floats("Set", variables).set
        self._plant = plant
        self._trusted = plant.description.ours

    def write(self, values: Sequence[float]) -> None:
        """Set all inputs of the group, in the order in which they were named, from now on."""
        plant = self._plant
        if plant.stopped is not None:
            plant.check_running()
        try:
            if not self._trusted and not isfinite(sum(values)):     # a trusted FMU refuses such a value by itself,
                plant.check_finite(self.names, values, "a value must be finite")        # and leaves all as they were
            status = self._set(values)
        except (TypeError, ValueError, OverflowError):
            raise PlantError(f"{plant.place()}: {', '.join(self.names)}: expected {len(self.names)} numbers, "
                             f"got {values!r}") from None
        if status:
            plant.check_finite(self.names, values, "a value must be finite")
            plant.check(status, f"setting {', '.join(self.names)}")


class OutputGroup:
    """Variables that are read together by one FMI call."""

    def __init__(self, plant: Plant, fmu: Fmu, variables: Sequence[Variable]) -> None:
        self.names = tuple(variable.name for variable in variables)
        self._get = fmu.floats("Get", variables).get
        self._plant = plant
        self._trusted = plant.description.ours

    def read(self) -> tuple[float, ...]:
        """The values at `plant.now_ns`, in the order in which they were named."""
        plant = self._plant
        if plant.stopped is not None:
            plant.check_running()
        values = self._get()
        if isinstance(values, int):
            plant.check(values, f"reading {', '.join(self.names)}")
        assert isinstance(values, tuple)
        if not self._trusted and not isfinite(sum(values)):
            plant.check_finite(self.names, values, "the FMU gave a value that is not finite")
        return values


class Plant:
    """One instance of the described FMU, initialized at time 0 with the start values given.

    `start` holds parameters, initial values and inputs; a nested list stands for the elements of a matrix.
    `fixed_step_ns` is for an FMU that takes only one step size and does not say which. With `logging` off an FMU is
    faster if it comments on every call, but may keep the reason of a failure to itself. `record` is told which FMI call
    runs.
    """

    def __init__(self, description: PlantDescription, instance_name: str, start: Mapping[str, Nested] | None = None,
                 fixed_step_ns: int | None = None, logging: bool = True, record: CallRecord | None = None) -> None:
        self.description = description
        self.now_ns = 0
        self.stopped: str | None = None        # why no call may reach the instance any more
        self._where = f"{description.file}: {instance_name}"
        self._fixed_ns: int | None = None
        if not description.variable_step:
            declared_s = description.fixed_step_s
            self._fixed_ns = fixed_step_ns or (round(declared_s * 1e9) if declared_s else None)
        start = self._checked_start(start or {})
        self._fmu = fmu = (Fmu3 if description.fmi == "3.0" else Fmu2)(description, instance_name, logging,
                                                                              record)
        self._set_start(start)
        for name, call, arguments in fmu.initialize():
            self.check(call(*arguments), fmu.prefix + name)
        fmu.in_step_mode[0] = True
        self._step = fmu.step()
        self._do_step = self._step.do
        self._h_ns = -1         # no step prepared yet
        self._any_step = description.variable_step
        self._watched = description.fmi == "3.0" and not description.ours      # may a step end elsewhere?

    def place(self) -> str:
        return f"{self._where} at t={self.now_ns / 1e9:.9g} s"

    def advance_to(self, t_ns: int) -> None:
        """Step to exactly `t_ns`; nothing happens when the plant is there already."""
        now_ns = self.now_ns
        h_ns = t_ns - now_ns
        if h_ns != self._h_ns:
            if h_ns > 0 and self._any_step:
                self._h_ns = h_ns
            elif h_ns == 0 or not self._prepare(h_ns, t_ns):
                return
        if self.stopped is not None:
            self.check_running()
        if status := self._do_step(now_ns / 1e9, h_ns / 1e9):
            self.check(status, f"a step of {h_ns / 1e9:.9g} s")
        if self._watched and (self._step.ended or self._step.last < t_ns / 1e9 - HALF_NS):
            self._stopped_short(t_ns)
        self.now_ns = t_ns

    def set(self, name: str, value: Value) -> None:
        """Set an input, or a tunable parameter, from now on."""
        self.check_running()
        variable = self.description.variable(name)
        if not variable.settable_while_stepping:
            raise PlantError(f"{self.place()}: {name} is {_kind(variable)}: only inputs and tunable parameters can be "
                             "set while the plant runs; give it as a start value")
        if problem := _misfit(variable, value):
            raise PlantError(f"{self.place()}: {problem}")
        self._set(variable, value)

    def get(self, name: str) -> Any:
        """The value at `now_ns`: float, int, bool or str by the variable's type, a tuple for an array."""
        self.check_running()
        variable = self.description.variable(name)
        if variable.type not in self._fmu.types:
            raise PlantError(f"{self.place()}: {name} is of type {variable.type}, which cannot be read here")
        call, arguments, values = self._fmu.typed("Get", [variable])
        if status := call(*arguments):
            self.check(status, f"reading {name}")
        convert: Callable[[Any], Any] = bool if variable.type == "Boolean" else _text if variable.type == "String" \
            else lambda value: value
        found = tuple(map(convert, values))
        return found[0] if variable.elements == 1 else found

    def input_group(self, names: Sequence[str], units: Sequence[str | None] | None = None) -> InputGroup:
        """Inputs to be set together; `units`, where given, have to be the FMU's."""
        variables = self._floats(names, units)
        for variable in variables:
            if not variable.settable_while_stepping:
                raise PlantError(f"{self._where}: {variable.name} is {_kind(variable)}, not an input; "
                                 f"inputs are {', '.join(self.description.names('input')) or 'none'}")
        return InputGroup(self, self._fmu, variables)

    def output_group(self, names: Sequence[str], units: Sequence[str | None] | None = None) -> OutputGroup:
        """Variables to be read together; `units`, where given, have to be the FMU's."""
        return OutputGroup(self, self._fmu, self._floats(names, units))

    def close(self) -> None:
        """Terminate and free the instance; the plant cannot be used afterwards."""
        self._stop("the plant is closed")
        self._fmu.release()

    def __enter__(self) -> Plant:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None,
                 ) -> None:
        self.close()

    def check(self, status: int, what: str) -> None:
        """Raise unless `status` is OK or a warning."""
        if status in (0, 1):
            return
        why = f"{what} failed with status {status_name(status)}{self._fmu.told()}"
        self._fmu.in_step_mode[0] = False   # FMI allows no `Terminate` after an error,
        if status == FATAL:
            self._fmu.release.detach()      # and after a fatal one not even to free the instance
        self._stop(f"it stopped after {why}")
        raise PlantError(f"{self.place()}: {why}")

    def check_finite(self, names: Sequence[str], values: Sequence[float], rule: str) -> None:
        """Raise for the first value that is infinite or not a number, if any: a sum may overflow without one."""
        for name, value in zip(names, values, strict=True):
            if not isfinite(value):
                self._fmu.messages.clear()
                raise PlantError(f"{self.place()}: {name}={value}: {rule}")

    def _stop(self, why: str) -> None:
        """Let no call reach the instance from now on."""
        self.stopped = why

    def check_running(self) -> None:
        if self.stopped is not None:
            raise PlantError(f"{self.place()}: {self.stopped}")

    def _prepare(self, h_ns: int, t_ns: int) -> bool:
        """Make ready for a step of `h_ns`; False if all of the way was gone already, in several fixed steps."""
        if h_ns < 0:
            raise PlantError(f"{self.place()}: asked for t={t_ns / 1e9:.9g} s: a plant does not go back in time")
        if not self.description.variable_step:
            self._fixed_ns = self._fixed_ns or h_ns
            steps, rest = divmod(h_ns, self._fixed_ns)
            if rest:
                raise PlantError(
                    f"{self.place()}: asked for t={t_ns / 1e9:.9g} s, but the FMU takes only steps of "
                    f"{self._fixed_ns / 1e9:.9g} s (canHandleVariableCommunicationStepSize=false): use instants that "
                    "are multiples of it, or an FMU with variable steps")
            if steps > 1:
                start_ns = self.now_ns
                for k in range(1, steps + 1):
                    self.advance_to(start_ns + k * self._fixed_ns)
                return False
        self._h_ns = h_ns
        return True

    def _stopped_short(self, t_ns: int) -> None:
        if self._step.asks_to_end:
            why = f"the FMU asks to end the simulation{self._fmu.told()}"
        else:
            why = (f"asked for t={t_ns / 1e9:.9g} s, but the FMU stopped at {self._step.last:.9g} s: it may have a "
                   f"fixed internal step; use instants that are multiples of it{self._fmu.told()}")
        self._stop(why)
        raise PlantError(f"{self.place()}: {why}")

    def _floats(self, names: Sequence[str], units: Sequence[str | None] | None) -> list[Variable]:
        self.check_running()
        if not names:
            raise PlantError(f"{self._where}: a group needs at least one variable")
        variables = [self.description.variable(name, unit)
                     for name, unit in zip(names, units or [None] * len(names), strict=True)]
        for variable in variables:
            if not variable.is_float64:
                raise PlantError(f"{self._where}: {variable.name} is of type {variable.type}"
                                 f"{f' with {variable.elements} elements' if variable.elements != 1 else ''}: a group "
                                 "holds 64-bit floating point scalars; use get and set for it")
        return variables

    def _checked_start(self, start: Mapping[str, Nested]) -> dict[str, Any]:
        """Start values by scalar variable; all that is wrong with them comes in one PlantError."""
        whole = {name: value for name, value in start.items() if name in self.description.variables}
        values: dict[str, Any] = whole | expand_parameters({k: v for k, v in start.items() if k not in whole})
        problems = []
        for name, value in values.items():
            try:
                variable = self.description.variable(name)
            except PlantError as error:
                problems.append(str(error))
                continue
            problem = _misfit(variable, value) or _out_of_bounds(variable, value)
            if not variable.settable_at_start:
                problem = f"{name} is {_kind(variable)}: it has no start value to set"
            if problem:
                problems.append(f"{self._where}: start: {problem}")
        if problems:
            raise PlantError("\n".join(problems))
        return values

    def _set_start(self, start: Mapping[str, Any]) -> None:
        variables = self.description.variables
        structural = [name for name in start if variables[name].causality == "structuralParameter"]
        if structural:
            self.check(self._fmu.function("EnterConfigurationMode")(self._fmu.handle), "entering configuration mode")
            for name in structural:
                self._set(variables[name], start[name])
            self.check(self._fmu.function("ExitConfigurationMode")(self._fmu.handle), "exiting configuration mode")
        for name, value in start.items():
            if name not in structural:
                self._set(variables[name], value)

    def _set(self, variable: Variable, value: Any) -> None:
        call, arguments, values = self._fmu.typed("Set", [variable])
        given = _flat(value)
        values[:] = [each.encode() if isinstance(each, str) else each for each in given]
        self.check(call(*arguments), f"setting {variable.name}={value}")


def _kind(variable: Variable) -> str:
    article = "an" if variable.causality[0] in "aeiou" else "a"
    return f"{article} {variable.causality}" + (" constant" if variable.variability == "constant" else "")


def _text(value: bytes | None) -> str:
    return (value or b"").decode(errors="replace")


def _flat(value: Any) -> list[Any]:
    return [each for part in value for each in _flat(part)] if isinstance(value, list | tuple) else [value]


def _out_of_bounds(variable: Variable, value: Any) -> str | None:
    """What the description's `min` and `max` say against a start value."""
    for each in _flat(value):
        if isinstance(each, Real) and (problem := outside(float(each), variable.min, variable.max)):
            return f"{variable.name}={each}: {problem}"
    return None


def _misfit(variable: Variable, value: Any) -> str | None:
    """What is wrong with `value` for this variable."""
    name, kind = variable.name, variable.type
    given = _flat(value)
    if len(given) != variable.elements:
        return f"{name}: {len(given)} values for {variable.elements} elements"
    for each in given:
        if kind in ("Real", "Float64", "Float32"):
            if isinstance(each, bool) or not isinstance(each, Real):
                return f"{name}={each!r}: a variable of type {kind} takes a number"
            if not isfinite(each):
                return f"{name}={each}: a value must be finite"
        elif kind == "Boolean":
            if not isinstance(each, bool):
                return f"{name}={each!r}: a variable of type {kind} takes true or false"
        elif kind == "String":
            if not isinstance(each, str):
                return f"{name}={each!r}: a variable of type {kind} takes a text"
        elif kind == "Enumeration" or "Int" in kind:
            if isinstance(each, bool) or not isinstance(each, Integral):
                return f"{name}={each!r}: a variable of type {kind} takes an integer"
        else:
            return f"{name}: variables of type {kind} cannot be set here"
    return None
