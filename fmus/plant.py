"""A plant: one FMU instance that is stepped lazily and exactly to the instants that matter.

Time is an int in nanoseconds; this package turns it into the float seconds of FMI, always from the integer, never by
adding steps up. Step sizes come from the integer difference, so equal steps are equal to the last bit.

An FMU that takes only steps of one size, or has a fixed internal step, stands at the last multiple of its step at or
before the instant asked for (`fmus/fixed_step.py`). Until the next one its outputs are held, and what is set waits.

*Invariants*
- `now_ns` is the instant that was asked for last; it moves only in `advance_to`, and never back.
- A value that is set acts from `now_ns` on; with fixed steps, from the first communication point at or after it on.
- With `present`, what is set or read is set or read at the present: the plant is stepped to it first.
- After a failed step, or after the model ended, the plant refuses everything but `close`.

Needs only ctypes and msgspec: FMPy reads the description elsewhere (`fmus.describe_fmu`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import isfinite, nan
from types import TracebackType
from typing import Any

import msgspec

from fmus.call_record import CallRecord
from fmus.description import PlantDescription, Variable
from fmus.errors import PlantEnded, PlantError
from fmus.fixed_step import FixedStep
from fmus.fmi_calls import FATAL, Fmu, Fmu2, Fmu3, status_name
from fmus.parameters import Nested, expand_parameters
from fmus.start_values import Misfit, elements_of, kind_in_words, start_values

HALF_NS = 0.5e-9        # in seconds: half the resolution of simulated time
DISCARD = 2
NO_STEP_NS = -2**62     # no step size has been prepared
PRESENT_ONLY = "a plant is stepped to the present true time only"

__all__ = ["InputGroup", "OutputGroup", "Plant", "PlantDescription", "PlantEnded", "PlantError", "expand_parameters"]


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
        if plant.present is not None and (present_ns := plant.present()) != plant.now_ns:
            plant.come_to(present_ns)
        if plant.stopped is not None:
            plant.check_running()
        if plant.between_points:
            self._keep(values)
            return
        try:
            if not self._trusted and not isfinite(sum(values)):     # a trusted FMU refuses such a value by itself,
                plant.check_finite(self.names, values, "a value must be finite")        # and leaves all as they were
            status = self._set(values)
        except (TypeError, ValueError, OverflowError):
            raise self._misfit(values) from None
        if status:
            plant.check_finite(self.names, values, "a value must be finite")
            plant.check(status, f"setting {', '.join(self.names)}")

    def _keep(self, values: Sequence[float]) -> None:
        """Let the values wait for the next communication point."""
        try:
            numbers = [float(value) for value in values]
        except (TypeError, ValueError, OverflowError):
            raise self._misfit(values) from None
        if len(numbers) != len(self.names):
            raise self._misfit(values)
        self._plant.check_finite(self.names, numbers, "a value must be finite")
        self._plant.set_later(self.names, partial(self._set, numbers))

    def _misfit(self, values: object) -> PlantError:
        return PlantError(f"{self._plant.place()}: {', '.join(self.names)}: expected {len(self.names)} numbers, got "
                          f"{values!r}")


class OutputGroup:
    """Variables that are read together by one FMI call. Unless `finite`, they may be infinite or not a number."""

    def __init__(self, plant: Plant, fmu: Fmu, variables: Sequence[Variable], finite: bool = True) -> None:
        self.names = tuple(variable.name for variable in variables)
        self._get = fmu.floats("Get", variables).get
        self._plant = plant
        self._trusted = plant.description.ours or not finite

    def read(self) -> tuple[float, ...]:
        """The values at `plant.now_ns`, in the order in which they were named."""
        plant = self._plant
        if plant.present is not None and (present_ns := plant.present()) != plant.now_ns:
            plant.come_to(present_ns)
        if plant.stopped is not None:
            plant.check_running()
        values = self._get()
        if isinstance(values, int):
            plant.check(values, f"reading {', '.join(self.names)}")
        assert isinstance(values, tuple)
        if not self._trusted and not isfinite(sum(values)):
            plant.check_finite(self.names, values, "the FMU gave a value that is not finite")
        return values

    def read_for_record(self) -> tuple[float, ...]:
        """As `read`, but not numbers once the plant has stopped, and values may be infinite."""
        plant = self._plant
        if plant.stopped is not None:
            return (nan,) * len(self.names)
        if plant.present is not None:
            plant.advance_to(plant.present())
        values = self._get()
        if isinstance(values, int):
            plant.check(values, f"reading {', '.join(self.names)}")
        assert isinstance(values, tuple)
        return values


class Plant:
    """One instance of the described FMU, initialized at time 0 with the start values given.

    `start` holds parameters, initial values and inputs, as `fmus/start_values.py` describes them. `fixed_step_ns` is
    for an FMU that takes only one step size and does not say which. With `logging` off an FMU is faster if it comments
    on every call, but may keep the reason of a failure to itself. `present` gives the instant [ns] at which the caller
    stands; without it the plant is where it was advanced to last. `on_end(why, time_ns)` is called when the model ends
    the simulation by itself, found out at `time_ns`, before PlantEnded is raised. `record` is told which FMI call runs.
    """

    def __init__(self, description: PlantDescription, instance_name: str, start: Mapping[str, Nested] | None = None,
                 fixed_step_ns: int | None = None, logging: bool = True, present: Callable[[], int] | None = None,
                 on_end: Callable[[str, int], None] | None = None, record: CallRecord | None = None) -> None:
        self.now_ns = 0
        self.stopped: str | None = None        # why no call may reach the instance any more
        self.present = present
        self.between_points = False            # what is set has to wait for a communication point
        self._on_end = on_end
        self._where = f"{description.file}: {instance_name}"
        self._grid = self._fixed_steps(description, fixed_step_ns)
        self._point = 0                        # the communication point at which the instance stands
        self._waiting: dict[tuple[str, ...], Callable[[], int]] = {}    # calls that set inputs at the next one
        found = start_values(description.variables, start or {})
        self._check_start(description, start or {}, found.complaints)
        self.description = msgspec.structs.replace(description, variables=dict(found.variables))
        self._fmu = fmu = (Fmu3 if description.fmi == "3.0" else Fmu2)(description, instance_name, logging,
                                                                              record)
        self._set_start(found.values)
        for name, call, arguments in fmu.initialize():
            self.check(call(*arguments), fmu.prefix + name)
        fmu.in_step_mode[0] = True
        self._step = fmu.step()
        self._do_step = self._step.do
        self._h_ns = NO_STEP_NS
        self._any_step = self._grid is None
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
            else:
                if h_ns:
                    self._advance_on_grid(t_ns)
                return
        if self.stopped is not None:
            self.check_running()
        if status := self._do_step(now_ns / 1e9, h_ns / 1e9):
            self._check_step(status, h_ns / 1e9, t_ns)
        if self._watched and (self._step.ended or self._step.last < t_ns / 1e9 - HALF_NS):
            self._stopped_short(t_ns)
        self.now_ns = t_ns

    def come_to_present(self) -> None:
        """Step to the present, for what is about to be set or read."""
        if self.present is not None:
            self.come_to(self.present())

    def come_to(self, present_ns: int) -> None:
        """Step to `present_ns`, where the caller stands."""
        if present_ns < self.now_ns:
            raise PlantError(f"{self._where}: set or read at t={present_ns / 1e9:.9g} s, but the plant was stepped to "
                             f"t={self.now_ns / 1e9:.9g} s already: {PRESENT_ONLY}")
        self.advance_to(present_ns)

    def set(self, name: str, value: Nested) -> None:
        """Set an input, or a tunable parameter, from now on."""
        self.come_to_present()
        self.check_running()
        variable = self.description.variable(name)
        if not variable.settable_while_stepping:
            raise PlantError(f"{self.place()}: {name} is {kind_in_words(variable)}: only inputs and tunable parameters "
                             "can be set while the plant runs; give it as a start value")
        try:
            elements = elements_of(variable, value)
        except Misfit as misfit:
            raise PlantError(f"{self.place()}: {name}={value!r}: {misfit}") from None
        if self.between_points:
            self.set_later((name,), partial(self._fmu.set_elements, variable, elements))
        else:
            self._set(variable, elements)

    def get(self, name: str) -> Any:
        """The value now: float, int, bool, str or bytes by the variable's type, a tuple for an array, rows first."""
        self.come_to_present()
        self.check_running()
        variable = self.description.variable(name)
        if variable.type not in self._fmu.types:
            raise PlantError(f"{self.place()}: {name} is of type {variable.type}, which cannot be read here")
        status, values = self._fmu.get_elements(variable)
        if status:
            self.check(status, f"reading {name}")
        convert: Callable[[Any], Any] = bool if variable.type == "Boolean" else _text if variable.type == "String" \
            else lambda value: value
        found = tuple(map(convert, values))
        return found if variable.shape else found[0]

    def input_group(self, names: Sequence[str], units: Sequence[str | None] | None = None) -> InputGroup:
        """Inputs to be set together; `units`, where given, have to be the FMU's."""
        variables = self._floats(names, units)
        for variable in variables:
            if not variable.settable_while_stepping:
                raise PlantError(f"{self._where}: {variable.name} is {kind_in_words(variable)}, not an input; "
                                 f"inputs are {', '.join(self.description.names('input')) or 'none'}")
        return InputGroup(self, self._fmu, variables)

    def output_group(self, names: Sequence[str], units: Sequence[str | None] | None = None, finite: bool = True,
                     ) -> OutputGroup:
        """Variables to be read together; `units`, where given, have to be the FMU's. Unless `finite`, a value that is
        infinite or not a number is no error."""
        return OutputGroup(self, self._fmu, self._floats(names, units), finite)

    def set_later(self, names: tuple[str, ...], call: Callable[[], int]) -> None:
        """Let `call`, which sets these inputs, wait for the next communication point; a later one takes its place."""
        self._waiting.pop(names, None)
        self._waiting[names] = call

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

    def _fixed_steps(self, description: PlantDescription, given_ns: int | None) -> FixedStep | None:
        """The communication points of an FMU that does not take every step size."""
        if given_ns is not None:
            if given_ns < 1:
                raise PlantError(f"{self._where}: a step of {given_ns} ns: expected at least 1 ns")
            return FixedStep(given_ns, 1)
        if description.fixed_step_s is not None:
            return FixedStep.of_seconds(description.fixed_step_s)
        if not description.variable_step:
            raise PlantError(f"{self._where}: the FMU takes only steps of one size and does not say which "
                             "(canHandleVariableCommunicationStepSize is not true): give its step")
        return None

    def _advance_on_grid(self, t_ns: int) -> None:
        """Go to `t_ns` by the steps that the FMU takes; refuse to go back."""
        if t_ns < self.now_ns:
            raise PlantError(f"{self.place()}: asked for t={t_ns / 1e9:.9g} s: a plant does not go back in time: "
                             f"{PRESENT_ONLY}")
        self.check_running()
        grid = self._grid
        assert grid is not None
        last = grid.points_until(t_ns)
        while self._point < last:
            together = self.description.variable_step and not self._waiting
            steps = last - self._point if together else 1
            length_s, end_s = grid.seconds(steps), grid.seconds(self._point + steps)
            status = self._do_step(grid.seconds(self._point), length_s)
            if status:
                self._check_step(status, length_s, t_ns)
            if self._watched and (self._step.ended or self._step.last < end_s - HALF_NS):
                self._stopped_short(t_ns)
            self._point += steps
            self.now_ns = grid.instant_ns(self._point)
            self.between_points = False
            waiting, self._waiting = self._waiting, {}
            for names, call in waiting.items():
                self.check(call(), f"setting {', '.join(names)}")
        self.now_ns = t_ns
        self.between_points = grid.instant_ns(self._point) != t_ns

    def _check_step(self, status: int, length_s: float, t_ns: int) -> None:
        """Raise unless the step was done: PlantEnded if the model ended the simulation in it."""
        if status == DISCARD:
            ended_s = self._step.last if self._step.asks_to_end else self._fmu.ended_s()
            if ended_s is not None:
                self._end(ended_s, t_ns)
        self.check(status, f"a step of {length_s:.9g} s")

    def _stopped_short(self, t_ns: int) -> None:
        if self._step.asks_to_end:
            self._end(self._step.last, t_ns)
        why = (f"asked for t={t_ns / 1e9:.9g} s, but the FMU stopped at {self._step.last:.9g} s: it may have a fixed "
               f"internal step that its description does not name; give it as plant.step_ms{self._fmu.told()}")
        self._stop(why)
        raise PlantError(f"{self.place()}: {why}")

    def _end(self, ended_s: float, t_ns: int) -> None:
        """The model ended the simulation by itself at `ended_s`, which came out on the way to `t_ns`."""
        ended_ns = min(max(self.now_ns, round(ended_s * 1e9)), t_ns) if isfinite(ended_s) else self.now_ns
        why = f"{self._where}: the model ended the simulation by itself at t={ended_ns / 1e9:.9g} s{self._fmu.told()}"
        self._stop("the model ended the simulation by itself")
        if self._on_end is not None:
            self._on_end(why, t_ns)
        raise PlantEnded(why, ended_ns)

    def _floats(self, names: Sequence[str], units: Sequence[str | None] | None) -> list[Variable]:
        self.check_running()
        if not names:
            raise PlantError(f"{self._where}: a group needs at least one variable")
        variables = [self.description.variable(name, unit)
                     for name, unit in zip(names, units or [None] * len(names), strict=True)]
        for variable in variables:
            if not variable.is_float64:
                raise PlantError(f"{self._where}: {variable.name} is of type {variable.type}"
                                 f"{f' with {variable.elements} elements' if variable.shape else ''}: a group "
                                 "holds 64-bit floating point scalars; use get and set for it")
        return variables

    def _check_start(self, description: PlantDescription, start: Mapping[str, Nested],
                     complaints: Mapping[str, str]) -> None:
        """Raise one PlantError with a line for each start value that does not fit."""
        problems = []
        for key, rule in complaints.items():
            if key not in description.variables and rule == "no such variable":
                try:
                    description.variable(key)
                except PlantError as error:
                    problems.append(str(error))
            else:
                problems.append(f"{self._where}: start: {key}={start[key]!r}: {rule}")
        if problems:
            raise PlantError("\n".join(problems))

    def _set_start(self, start: Mapping[str, list[Any]]) -> None:
        variables = self.description.variables
        structural = [name for name in start if variables[name].causality == "structuralParameter"]
        if structural:
            self.check(self._fmu.function("EnterConfigurationMode")(self._fmu.handle), "entering configuration mode")
            for name in structural:
                self._set(variables[name], start[name])
            self.check(self._fmu.function("ExitConfigurationMode")(self._fmu.handle), "exiting configuration mode")
        for name, elements in start.items():
            if name not in structural:
                self._set(variables[name], elements)

    def _set(self, variable: Variable, elements: list[Any]) -> None:
        if elements:
            self.check(self._fmu.set_elements(variable, elements), f"setting {variable.name}")


def _text(value: bytes | None) -> str:
    return (value or b"").decode(errors="replace")
