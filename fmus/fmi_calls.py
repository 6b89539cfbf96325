"""Calls of FMI's functions, for one instance of a co-simulation FMU of FMI 2.0 or 3.0; no other file knows them.

Most calls go through ctypes without `argtypes`, so each writes its C types out. The three calls that a running plant
makes often (step, set and get floating point values) are bound once, in C if bound_calls.c was compiled. A call of an
FMU of this project takes about a microsecond and keeps the interpreter lock; a call of any other FMU releases it.

Event mode is used by `event_calls.py` only; any other FMI 3.0 FMU handles its events within its steps.
Not used: intermediate update.
"""

from __future__ import annotations

import ctypes as c
from collections import deque
from collections.abc import Callable, Sequence
from functools import cache, partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from weakref import WeakValueDictionary, finalize

from fmus.call_record import CallRecord, NoRecord, recorded
from fmus.description import PlantDescription, Variable
from fmus.errors import PlantError

if TYPE_CHECKING:
    from fmus.bound_calls import BoundStep, BoundValues
else:
    try:
        from fmus.bound_calls import BoundStep, BoundValues
    except ModuleNotFoundError:         # bound_calls.c was not compiled
        from fmus.ctypes_calls import BoundStep, BoundValues

STATUS: Final = ("ok", "warning", "discard", "error", "fatal", "pending")
FATAL: Final = 4

Call = Callable[..., int]

# variable type in the XML -> (infix of the get and set functions, C type)
TYPES_FMI2: Final[dict[str, tuple[str, Any]]] = {
    "Real": ("Real", c.c_double), "Integer": ("Integer", c.c_int), "Enumeration": ("Integer", c.c_int),
    "Boolean": ("Boolean", c.c_int), "String": ("String", c.c_char_p),
}
TYPES_FMI3: Final[dict[str, tuple[str, Any]]] = {
    "Float64": ("Float64", c.c_double), "Float32": ("Float32", c.c_float), "Boolean": ("Boolean", c.c_bool),
    "Int8": ("Int8", c.c_int8), "Int16": ("Int16", c.c_int16), "Int32": ("Int32", c.c_int32),
    "Int64": ("Int64", c.c_int64), "UInt8": ("UInt8", c.c_uint8), "UInt16": ("UInt16", c.c_uint16),
    "UInt32": ("UInt32", c.c_uint32), "UInt64": ("UInt64", c.c_uint64), "Enumeration": ("Int64", c.c_int64),
    "String": ("String", c.c_char_p), "Binary": ("Binary", c.c_void_p),
}
LAST_SUCCESSFUL_TIME: Final = 2         # fmi2StatusKind
TERMINATED: Final = 3                   # fmi2StatusKind


class Messages(deque[tuple[int, str]]):
    """The latest messages of one FMU instance, as pairs (FMI status, text)."""

    def __hash__(self) -> int:      # type: ignore[override]  # by identity, as `_messages` and `finalize` need it
        return id(self)


# FMPy's formatter keeps one logger for all FMI 2.0 instances of a process. So all instances share one logger, which
# finds the instance by the number passed as FMI's environment; a message with an unknown number is dropped.
_messages: WeakValueDictionary[int, Messages] = WeakValueDictionary()
_numbers = count(1)


def _note(environment: int | None, status: int, text: bytes | None) -> None:
    messages = _messages.get(environment or 0)
    if messages is not None and text:
        messages.append((status, " ".join(text.decode(errors="replace").split())[:1000]))


def status_name(status: int) -> str:
    return STATUS[status] if 0 <= status < len(STATUS) else f"{status} (unknown to FMI)"


_logger_fmi2 = c.CFUNCTYPE(None, c.c_void_p, c.c_char_p, c.c_int, c.c_char_p, c.c_char_p)(
    lambda environment, _name, status, _category, text: _note(environment, status, text))
_logger_fmi3 = c.CFUNCTYPE(None, c.c_void_p, c.c_int, c.c_char_p, c.c_char_p)(
    lambda environment, status, _category, text: _note(environment, status, text))


class _Callbacks(c.Structure):
    _fields_ = (("logger", c.c_void_p), ("allocate", c.c_void_p), ("free", c.c_void_p), ("step_finished", c.c_void_p),
                ("environment", c.c_void_p))


@cache
def _library(binary: str, ours: bool) -> c.CDLL:
    """Load a binary once for all of its instances; the system would not unload it either."""
    return (c.PyDLL if ours else c.CDLL)(binary)


def _function(library: c.CDLL, prefix: str, description: PlantDescription, name: str, result: Any = c.c_int) -> Call:
    try:
        found = getattr(library, prefix + name)
    except AttributeError:
        raise PlantError(f"{description.file}: its binary lacks the function {prefix}{name}: "
                         f"it is no complete FMI {description.fmi} binary; export it again") from None
    found.restype = result
    return found    # type: ignore[no-any-return]


def _recorded(library: c.CDLL, prefix: str, description: PlantDescription, record: CallRecord, name: str,
              result: Any = c.c_int) -> Call:
    return recorded(_function(library, prefix, description, name, result), record, _name(prefix, name, description))


def _name(prefix: str, function: str, description: PlantDescription) -> str:
    return f"{prefix}{function} of plant {description.model_name}"


def _end(function: Callable[..., Call], handle: Any, in_step_mode: list[bool], _kept: object) -> None:
    """Terminate and free an instance; `finalize` calls this before the interpreter exits, since an FMU may call back.

    `_kept` holds what the instance may use until then: its messages and callbacks."""
    if in_step_mode[0]:
        function("Terminate")(handle)
    function("FreeInstance", None)(handle)


class Fmu:
    """One instance, from instantiation until `release` is called or the object is collected.

    The subclasses make the calls that differ between the versions of FMI. PlantError is raised if the binary cannot be
    loaded, lacks a function or makes no instance."""

    prefix: str
    version: int
    types: dict[str, tuple[str, Any]]
    state_word: str                     # in the names of the functions that save and restore the state
    deserialize: str
    _callbacks: _Callbacks | None = None

    def __init__(self, description: PlantDescription, instance_name: str, logging: bool,
                 record: CallRecord | None = None) -> None:
        self.description = description
        self.record = record or NoRecord()
        self.messages = Messages(maxlen=20)
        self.number = next(_numbers)
        _messages[self.number] = self.messages
        try:
            self._library = _library(description.binary, description.ours)
        except OSError as error:
            raise PlantError(f"{description.file}: its binary cannot be loaded: {error}: "
                             "it may need libraries that are not installed here") from None
        handle = self._instantiate(instance_name.encode(), logging)
        if not handle:
            hint = "the FMU allows one instance per process: give each its own process" \
                if description.once_per_process else "see the FMU's documentation for what it needs"
            raise PlantError(f"{description.file}: cannot be instantiated as {instance_name!r}{self.told()}: {hint}")
        self._address = handle
        self.handle = c.c_void_p.from_param(handle)
        self.in_step_mode = [False]                 # True: `Terminate` has to precede `FreeInstance`
        self.release = finalize(self, _end, partial(_recorded, self._library, self.prefix, description, self.record),
                                self.handle, self.in_step_mode, (self.messages, self._callbacks))

    def function(self, name: str, result: Any = c.c_int) -> Call:
        return _recorded(self._library, self.prefix, self.description, self.record, name, result)

    def told(self) -> str:
        """Return the FMU's messages since the last call, as text to append to an error; "" if there are none."""
        told = [(status, text) for status, text in self.messages if status] or list(self.messages)[-3:]
        self.messages.clear()
        return "; the FMU says: " * bool(told) + " | ".join(f"[{status_name(status)}] {text}" for status, text in told)

    def set_elements(self, variable: Variable, elements: Sequence[Any]) -> int:
        """Set all elements of one variable to values of its C type; returns the FMI status."""
        infix, c_type = self.types[variable.type]
        values = (c_type * len(elements))()
        if variable.type == "Binary":
            sizes = (c.c_size_t * len(elements))(*map(len, elements))
            kept = [(c.c_uint8 * max(1, len(each))).from_buffer_copy(each or b"\0") for each in elements]
            values[:] = [c.cast(each, c.c_void_p) for each in kept]
            return self.function("SetBinary")(*self._one(variable), c.byref(sizes), c.byref(values),
                                              c.c_size_t.from_param(len(elements)))
        values[:] = elements
        return self.function("Set" + infix)(*self._one(variable), c.byref(values), *self._tail(values))

    def get_elements(self, variable: Variable) -> tuple[int, list[Any]]:
        """Return the FMI status and the elements of one variable as values of its C type."""
        infix, c_type = self.types[variable.type]
        values = (c_type * variable.elements)()
        if variable.type == "Binary":
            sizes = (c.c_size_t * variable.elements)()
            status = self.function("GetBinary")(*self._one(variable), c.byref(sizes), c.byref(values),
                                                c.c_size_t.from_param(variable.elements))
            if status > 1 or status < 0:
                return status, []
            return status, [c.string_at(each, size) if each else b"" for each, size in zip(values, sizes, strict=True)]
        status = self.function("Get" + infix)(*self._one(variable), c.byref(values), *self._tail(values))
        return status, list(values)

    def _one(self, variable: Variable) -> tuple[Any, ...]:
        """Return the first arguments of every call that sets or gets one variable."""
        return self.handle, c.byref((c.c_uint * 1)(variable.reference)), c.c_size_t.from_param(1)

    def ended_s(self) -> float | None:
        """Return, after a discarded step, the last time reached [s] if the model ended the simulation, else None."""
        return None

    def serialized_state(self) -> tuple[int, bytes]:
        """Return the FMI status and the state of the instance as bytes."""
        state, size = c.c_void_p(), c.c_size_t()
        status = self._on_state("Get{}")(self.handle, c.byref(state))
        if status > 1:
            return status, b""
        try:
            status = self._on_state("Serialized{}Size")(self.handle, state, c.byref(size))
            found = (c.c_uint8 * size.value)()
            if status <= 1:
                status = self._on_state("Serialize{}")(self.handle, state, found, size)
        finally:
            self._on_state("Free{}")(self.handle, c.byref(state))
        return status, bytes(found)

    def restore_state(self, data: bytes) -> int:
        """Set the state of the instance to one that `serialized_state` returned; returns the FMI status."""
        state = c.c_void_p()
        status = self._on_state(self.deserialize)(self.handle, (c.c_uint8 * len(data)).from_buffer_copy(data),
                                                  c.c_size_t(len(data)), c.byref(state))
        if status > 1:
            return status
        try:
            return self._on_state("Set{}")(self.handle, state)
        finally:
            self._on_state("Free{}")(self.handle, c.byref(state))

    def _on_state(self, name: str) -> Call:
        return self.function(name.format(self.state_word))

    def step(self) -> BoundStep:
        step = BoundStep(self._address_of("DoStep"), self._address, self.version, self.description.ours)
        step.watch(self.record.call_word, self.record.place(self._name_of("DoStep")))
        return step

    def floats(self, verb: str, variables: Sequence[Variable]) -> BoundValues:
        """Bind the call that sets (`verb` "Set") or gets ("Get") all of `variables`, 64-bit floating point scalars."""
        infix, _ = self.types[variables[0].type]
        values = BoundValues(self._address_of(verb + infix), self._address, [each.reference for each in variables],
                             self.version, self.description.ours)
        values.watch(self.record.call_word, self.record.place(self._name_of(verb + infix)))
        return values

    def _address_of(self, name: str) -> int:
        function = _function(self._library, self.prefix, self.description, name)
        return c.cast(function, c.c_void_p).value or 0      # type: ignore[arg-type]

    def _name_of(self, function: str) -> str:
        return _name(self.prefix, function, self.description)

    def initialize(self) -> list[tuple[str, Call, tuple[Any, ...]]]:
        """Return the calls that lead from the start values to step mode, as (name, function, arguments)."""
        raise NotImplementedError

    def _instantiate(self, name: bytes, logging: bool) -> int | None:
        raise NotImplementedError

    def _tail(self, values: Any) -> tuple[Any, ...]:
        raise NotImplementedError


class Fmu2(Fmu):
    prefix = "fmi2"
    version = 2
    types = TYPES_FMI2
    state_word = "FMUstate"
    deserialize = "DeSerialize{}"

    def _instantiate(self, name: bytes, logging: bool) -> int | None:
        libc = c.CDLL(None) if hasattr(c, "RTLD_GLOBAL") and not hasattr(c, "windll") else c.cdll.msvcrt
        self._callbacks = _Callbacks(
            c.cast(_logger_fmi2, c.c_void_p), c.cast(libc.calloc, c.c_void_p), c.cast(libc.free, c.c_void_p), None,
            self.number)
        if self.description.log_formatter and Path(self.description.log_formatter).is_file():
            c.CDLL(self.description.log_formatter).addLoggerProxy(c.byref(self._callbacks))
        resources = Path(self.description.resources).absolute().as_uri().encode()
        result: int | None = self.function("Instantiate", c.c_void_p)(
            c.c_char_p(name), c.c_int(1), c.c_char_p(self.description.token.encode()), c.c_char_p(resources),
            c.byref(self._callbacks), c.c_int(0), c.c_int(logging))
        return result

    def _tail(self, values: Any) -> tuple[Any, ...]:
        return ()

    def ended_s(self) -> float | None:
        terminated, last = c.c_int(0), c.c_double(-1.0)
        try:
            status = self.function("GetBooleanStatus")(self.handle, c.c_int(TERMINATED), c.byref(terminated))
            if status > 1 or not terminated.value:
                return None
            self.function("GetRealStatus")(self.handle, c.c_int(LAST_SUCCESSFUL_TIME), c.byref(last))
        except PlantError:              # the binary lacks these functions
            return None
        return last.value

    def initialize(self) -> list[tuple[str, Call, tuple[Any, ...]]]:
        none = c.c_double(0)
        return [("SetupExperiment", self.function("SetupExperiment"),
                 (self.handle, c.c_int(0), none, none, c.c_int(0), none)),
                ("EnterInitializationMode", self.function("EnterInitializationMode"), (self.handle,)),
                ("ExitInitializationMode", self.function("ExitInitializationMode"), (self.handle,))]


class Fmu3(Fmu):
    prefix = "fmi3"
    version = 3
    types = TYPES_FMI3
    state_word = "FMUState"
    deserialize = "Deserialize{}"
    in_event_mode = False               # True: the host handles events, and a step may return early for one

    def _instantiate(self, name: bytes, logging: bool) -> int | None:
        resources = self.description.resources
        folder = f"{resources}/".encode() if Path(resources).is_dir() else None
        result: int | None = self.function("InstantiateCoSimulation", c.c_void_p)(
            c.c_char_p(name), c.c_char_p(self.description.token.encode()), c.c_char_p(folder), c.c_bool(False),
            c.c_bool(logging), c.c_bool(self.in_event_mode), c.c_bool(self.in_event_mode), None, c.c_size_t(0),
            c.c_void_p(self.number), _logger_fmi3, None)
        return result

    def _tail(self, values: Any) -> tuple[Any, ...]:
        return (c.c_size_t.from_param(len(values)),)

    def initialize(self) -> list[tuple[str, Call, tuple[Any, ...]]]:
        none = c.c_double(0)
        return [("EnterInitializationMode", self.function("EnterInitializationMode"),
                 (self.handle, c.c_bool(False), none, none, c.c_bool(False), none)),
                ("ExitInitializationMode", self.function("ExitInitializationMode"), (self.handle,))]
