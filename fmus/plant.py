"""A plant: one FMU instance that is stepped only when needed, exactly to the instants at which it is set or read.

Time is an int in nanoseconds. This package converts it to the float seconds of FMI, always from the integer and never
by adding steps up. Step sizes come from the integer difference, so equal steps are equal to the last bit.

An FMU that takes only steps of one size, or has a fixed internal step, is stepped to the last multiple of its step at
or before the requested instant (`fmus/fixed_step.py`). Until the next multiple its outputs are constant and a value
that the caller sets waits.

*Invariants*
- `now_ns` is the instant requested last; only `advance_to` changes it, and never to an earlier one.
- A value acts from the `now_ns` at which it is set; with fixed steps, from the first communication point at or after.
- With `present`, the plant is stepped to the present before a value is set or read.
- After a failed step, or after the model ended the simulation, every call but `close` raises PlantError.

Imports only ctypes and msgspec: `fmus.describe_fmu`, which imports FMPy, reads the description.
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
from fmus.input_faults import Change, InputFaults
from fmus.parameters import Nested, expand_parameters
from fmus.plant_state import Diary, PlantState
from fmus.start_values import Misfit, elements_of, kind_in_words, start_values

HALF_NS = 0.5e-9        # [s] half the resolution of simulated time
DISCARD = 2             # FMI status
NO_STEP_NS = -2**62     # mark of a plant that has made no step yet
PRESENT_ONLY = "a plant is stepped to the present true time only"

__all__ = ["InputGroup", "OutputGroup", "Plant", "PlantDescription", "PlantEnded", "PlantError", "expand_parameters"]


class InputGroup:
    """Inputs that are set together by one FMI call."""

    def __init__(self, plant: Plant, fmu: Fmu, variables: Sequence[Variable]) -> None:
        self.names = tuple(variable.name for variable in variables)
        self._set = plant.noted(self.names, fmu.floats("Set", variables).set)
        self._plant = plant
        self._trusted = plant.description.ours
        plant.input_groups.append(self)

    def let_change(self, faults: InputFaults) -> None:
        """Let faults change the values that are written from now on."""
        self._set = faults.of_values(self.names, self._set)

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
            if not self._trusted and not isfinite(sum(values)):     # a trusted FMU refuses a non-finite value itself
                plant.check_finite(self.names, values, "a value must be finite")        # and then sets none
            status = self._set(values)
        except (TypeError, ValueError, OverflowError):
            raise self._misfit(values) from None
        if status:
            plant.check_finite(self.names, values, "a value must be finite")
            plant.check(status, f"setting {', '.join(self.names)}")

    def _keep(self, values: Sequence[float]) -> None:
        """Check the values and set them at the next communication point."""
        try:
            numbers = [float(value) for value in values]
        except (TypeError, ValueError, OverflowError):
            raise self._misfit(values) from None
        if len(numbers) != len(self.names):
            raise self._misfit(values)
        self._plant.check_finite(self.names, numbers, "a value must be finite")
        self._plant.set_later(self.names, numbers, partial(self._set, numbers))

    def _misfit(self, values: object) -> PlantError:
        return PlantError(f"{self._plant.place()}: {', '.join(self.names)}: expected {len(self.names)} numbers, got "
                          f"{values!r}")


class OutputGroup:
    """Variables that are read together by one FMI call; with `finite`, a value that is not finite is an error."""

    def __init__(self, plant: Plant, fmu: Fmu, variables: Sequence[Variable], finite: bool = True) -> None:
        self.names = tuple(variable.name for variable in variables)
        self._get = fmu.floats("Get", variables).get
        self._plant = plant
        self._trusted = plant.description.ours or not finite

    def read(self) -> tuple[float, ...]:
        """Return the values at the present, or without `present` at `plant.now_ns`, in the order of `names`.

        Raises PlantError if the FMU reports a failure, or with `finite` for a value that is not finite."""
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
        """Return the values as `read` does, not checked to be finite; all nan once the plant has stopped."""
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
    the step of an FMU that takes only one step size and does not declare it. Without `logging` an FMU that logs every
    call is faster, but may not report why a call failed. `present` returns the caller's true time [ns]; without it the
    plant stays at the instant of the last `advance_to`. If the model ends the simulation while the plant is stepped to
    `time_ns`, `on_end(why, time_ns)` is called before PlantEnded is raised. `record` notes which FMI call runs. A
    `mortal` plant can save its state, for which one whose FMU cannot keeps a diary from the start.
    """

    def __init__(self, description: PlantDescription, instance_name: str, start: Mapping[str, Nested] | None = None,
                 fixed_step_ns: int | None = None, logging: bool = True, present: Callable[[], int] | None = None,
                 on_end: Callable[[str, int], None] | None = None, record: CallRecord | None = None,
                 mortal: bool = False) -> None:
        self.now_ns = 0
        self.stopped: str | None = None        # why the plant refuses calls; None while it accepts them
        self.present = present
        self.between_points = False            # True: a value that is set waits for the next communication point
        self._on_end = on_end
        self._where = f"{description.file}: {instance_name}"
        self._grid = self._fixed_steps(description, fixed_step_ns)
        self._point = 0                        # index of the communication point that the instance has reached
        # values that are set at the next point, and the calls that set them
        self._waiting: dict[tuple[str, ...], tuple[list[Any], Callable[[], int]]] = {}
        self._diary: Diary | None = None
        self._faults: InputFaults | None = None
        self.input_groups: list[InputGroup] = []
        found = start_values(description.variables, start or {})
        self._check_start(description, start or {}, found.complaints)
        self.description = msgspec.structs.replace(description, variables=dict(found.variables))
        self._fmu = fmu = self._instance(description, instance_name, logging, record)
        self._set_start(found.values)
        for name, call, arguments in fmu.initialize():
            self.check(call(*arguments), fmu.prefix + name)
        fmu.in_step_mode[0] = True
        if mortal and not description.saves_state:
            self._diary = Diary()
        self._step = fmu.step()
        self._do_step: Any = self._step.do if self._diary is None else self._diary.of_steps(self._step.do)
        self._h_ns = NO_STEP_NS
        self._any_step = self._grid is None
        self._watched = description.fmi == "3.0" and not description.ours      # a step may end early: check its end

    def _instance(self, description: PlantDescription, name: str, logging: bool, record: CallRecord | None) -> Fmu:
        return (Fmu3 if description.fmi == "3.0" else Fmu2)(description, name, logging, record)

    def place(self) -> str:
        return f"{self._where} at t={self.now_ns / 1e9:.9g} s"

    def advance_to(self, t_ns: int) -> None:
        """Step to exactly `t_ns`; does nothing if that is `now_ns`. Raises PlantError for an earlier instant."""
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
        """Step to the instant that `present` returns, before a value is set or read; does nothing without `present`."""
        if self.present is not None:
            self.come_to(self.present())

    def come_to(self, present_ns: int) -> None:
        """Step to `present_ns`, the caller's true time; raises PlantError if the plant was stepped past it."""
        if present_ns < self.now_ns:
            raise PlantError(f"{self._where}: set or read at t={present_ns / 1e9:.9g} s, but the plant was stepped to "
                             f"t={self.now_ns / 1e9:.9g} s already: {PRESENT_ONLY}")
        self.advance_to(present_ns)

    def set(self, name: str, value: Nested) -> None:
        """Set an input or a tunable parameter from the present on; raises PlantError for another kind or a misfit."""
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
            self.set_later((name,), elements, partial(self._set_elements(variable), elements))
        else:
            self._set(variable, elements)

    def change_input(self, name: str, change: Change, begins: bool) -> None:
        """Let a fault change the values set for an input, a scalar, from the present on, or end the fault.

        A plant that has stopped stays as it is.
        """
        if self.stopped is not None:
            return
        self.come_to_present()
        faults = self._input_faults()
        asked = self._asked(name)
        if begins:
            faults.begin(name, change, asked)
        else:
            asked = faults.end(name, change)
        if any(name in names for names in self._waiting):
            return                      # set anew at the next communication point
        variable = self.description.variable(name)
        if self.between_points:
            self.set_later((name,), [asked], partial(self._set_elements(variable), [asked]))
        else:
            self._set(variable, [asked])

    def change(self, name: str, change: Change) -> None:
        """Change an input or a tunable parameter at the present; with a factor or a bias, the value set last.

        A plant that has stopped stays as it is.
        """
        if self.stopped is None:
            self.come_to_present()
            self.set(name, change.by if change.how == "value" else change.of(self._asked(name)))

    def _asked(self, name: str) -> Any:
        """Return the value of a scalar that was set last, whether or not a fault changes it."""
        for names, (values, _) in reversed(self._waiting.items()):
            if name in names:
                return values[names.index(name)]
        if self._faults is not None and name in self._faults.asked:
            return self._faults.asked[name]
        return self.get(name)

    def _input_faults(self) -> InputFaults:
        """Return the faults of the inputs; from the first call on, all values pass them on their way to the FMU."""
        faults = self._faults
        if faults is None:
            faults = self._faults = InputFaults()
            for group in self.input_groups:
                group.let_change(faults)
            self._set_waiting_anew([(names, values) for names, (values, _) in self._waiting.items()])
        return faults

    def _set_waiting_anew(self, waiting: Sequence[tuple[tuple[str, ...], list[Any]]]) -> None:
        self._waiting = {names: (values, partial(self._set_call(names), values)) for names, values in waiting}

    def get(self, name: str) -> Any:
        """Return the present value: float, int, bool, str or bytes by type; of an array a flat tuple, rows first."""
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
        """Return inputs to be set together; raises PlantError if a unit is given that the FMU does not declare."""
        variables = self._floats(names, units)
        for variable in variables:
            if not variable.settable_while_stepping:
                raise PlantError(f"{self._where}: {variable.name} is {kind_in_words(variable)}, not an input; "
                                 f"inputs are {', '.join(self.description.names('input')) or 'none'}")
        return InputGroup(self, self._fmu, variables)

    def output_group(self, names: Sequence[str], units: Sequence[str | None] | None = None, finite: bool = True,
                     ) -> OutputGroup:
        """Return variables to be read together; raises PlantError if a unit is given that the FMU does not declare.

        With `finite`, reading a value that is infinite or not a number raises PlantError too."""
        return OutputGroup(self, self._fmu, self._floats(names, units), finite)

    def set_later(self, names: tuple[str, ...], values: list[Any], call: Callable[[], int]) -> None:
        """Make `call`, which sets `names` to `values`, at the next communication point; it replaces an earlier one."""
        self._waiting.pop(names, None)
        self._waiting[names] = values, call

    def noted(self, names: tuple[str, ...], set_values: Callable[[Any], int]) -> Callable[[Any], int]:
        """Return `set_values`, which sets the variables `names`, so that faults change and the diary has its values."""
        if self._diary is not None:
            set_values = self._diary.of_values(names, set_values)
        return set_values if self._faults is None else self._faults.of_values(names, set_values)

    def state(self) -> bytes:
        """Return the state of a mortal plant, for `restore` in another process."""
        fmu = b""
        if self._diary is None:
            status, fmu = self._fmu.serialized_state()
            self.check(status, "saving its state")
        return msgspec.msgpack.encode(PlantState(
            self.now_ns, self._point, self.between_points,
            [(names, values) for names, (values, _) in self._waiting.items()], self.stopped, fmu,
            [] if self._diary is None else self._diary.calls,
            {} if self._faults is None else self._faults.acting, {} if self._faults is None else self._faults.asked))

    def restore(self, state: bytes) -> None:
        """Continue, as a plant that was just made with the same arguments, where another one's `state` was saved."""
        found = msgspec.msgpack.decode(state, type=PlantState)
        if found.fmu:
            self.check(self._fmu.restore_state(found.fmu), "restoring its state")
        for names, values in found.diary:
            if not names:
                self._do_step(*values)          # a step that failed left its reason in `stopped`
            else:
                self.check(self._set_call(names)(values), f"setting {', '.join(names)}")
        self.now_ns, self._point, self.between_points = found.now_ns, found.point, found.between_points
        if found.acting:
            self._faults = InputFaults(found.acting, found.asked)
            for group in self.input_groups:
                group.let_change(self._faults)
        self._set_waiting_anew(found.waiting)
        self.stopped = found.stopped

    def _set_call(self, names: tuple[str, ...]) -> Callable[[Any], int]:
        """Return the call that sets one variable of any type, or several floating point scalars."""
        variables = [self.description.variable(name) for name in names]
        if len(names) == 1:
            return self._set_elements(variables[0])
        return self.noted(names, self._fmu.floats("Set", variables).set)

    def _set_elements(self, variable: Variable) -> Callable[[Any], int]:
        return self.noted((variable.name,), partial(self._fmu.set_elements, variable))

    def close(self) -> None:
        """Terminate and free the instance; every later call raises PlantError."""
        self.stopped = "the plant is closed"
        self._fmu.release()

    def __enter__(self) -> Plant:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None,
                 ) -> None:
        self.close()

    def check(self, status: int, what: str) -> None:
        """Raise PlantError, and stop the plant, unless `status` of the call `what` is OK or a warning."""
        if status in (0, 1):
            return
        why = f"{what} failed with status {status_name(status)}{self._fmu.told()}"
        self._fmu.in_step_mode[0] = False   # FMI forbids `Terminate` after an error,
        if status == FATAL:
            self._fmu.release.detach()      # and `FreeInstance` after a fatal one
        self.stopped = f"it stopped after {why}"
        raise PlantError(f"{self.place()}: {why}")

    def check_finite(self, names: Sequence[str], values: Sequence[float], rule: str) -> None:
        """Raise PlantError for the first value that is not finite, if any; a sum of finite values may overflow."""
        for name, value in zip(names, values, strict=True):
            if not isfinite(value):
                self._fmu.messages.clear()
                raise PlantError(f"{self.place()}: {name}={value}: {rule}")

    def _stop(self, why: str) -> None:
        """Refuse calls from now on, for the reason `why`."""
        self.stopped = why

    def check_running(self) -> None:
        if self.stopped is not None:
            raise PlantError(f"{self.place()}: {self.stopped}")

    def _fixed_steps(self, description: PlantDescription, given_ns: int | None) -> FixedStep | None:
        """Return the communication points of an FMU with a fixed step; None for one that takes any step size."""
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
        """Step to the last communication point not after `t_ns`; raises PlantError for an instant before `now_ns`."""
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
            for names, (_, call) in waiting.items():
                self.check(call(), f"setting {', '.join(names)}")
        self.now_ns = t_ns
        self.between_points = grid.instant_ns(self._point) != t_ns

    def _check_step(self, status: int, length_s: float, t_ns: int) -> None:
        """Raise PlantEnded if the model ended the simulation in this step, PlantError if the step failed otherwise."""
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
        self.stopped = why
        raise PlantError(f"{self.place()}: {why}")

    def _end(self, ended_s: float, t_ns: int) -> None:
        """Stop the plant and raise PlantEnded: the model ended at `ended_s` [s], in a step towards `t_ns`."""
        ended_ns = min(max(self.now_ns, round(ended_s * 1e9)), t_ns) if isfinite(ended_s) else self.now_ns
        why = f"{self._where}: the model ended the simulation by itself at t={ended_ns / 1e9:.9g} s{self._fmu.told()}"
        self.stopped = "the model ended the simulation by itself"
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
            self.check(self._set_elements(variable)(elements), f"setting {variable.name}")


def _text(value: bytes | None) -> str:
    return (value or b"").decode(errors="replace")
