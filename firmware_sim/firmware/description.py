"""firmware.toml: everything that a firmware names, and thereby what its scenario has to provide.

    name, about                     of the firmware
    companion                       "package.module:Class" with its `check`, `prepare` and `configure` (see program.py)
    mavlink                         dialect of MAVLink whose headers in C the files may include
    [[ports]]                       name of the medium; listen_only
    [[parameters]]                  name, type, default, min, max, columns: set in a scenario
    [[configuration]]               name: values that the companion computes from the scenario
    [[sensors]] [[actuators]]       name of a plant's variable, unit; entries: it is an array of up to so many
    [[counters]]                    name
    [[signals]]                     name, unit; sensor or actuator whose value it is; count: parameter with its length
    [[events]]                      name, level: info, warning

The position of a row is its number in board_ids.h; a row with `entries` takes as many numbers.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from functools import cached_property
from pathlib import Path
from typing import Any, Final, Literal

import msgspec

from firmware_sim.firmware.errors import FirmwareError

TABLE: Final = "firmware.toml"
MOST_ENTRIES: Final = 64
_PLACE: Final = re.compile(r"^(.*?)(?: - at `\$\.?(.*)`)?$", re.DOTALL)


class Port(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """`listen_only`: no frame that arrives here makes the firmware send a frame earlier than planned."""

    name: str
    listen_only: bool = False
    about: str = ""


class Parameter(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """`rows` is a list of rows with `columns` numbers each, which the firmware reads one after the other.

    `choice` is one of the words `choices`, of which the firmware reads the position, from 0 on.
    """

    name: str
    type: Literal["float", "int", "bool", "floats", "rows", "choice"] = "float"
    default: float | bool | str | list[Any] | None = None     # None: the scenario has to set it
    min: float | None = None
    max: float | None = None
    columns: int = 0
    choices: tuple[str, ...] = ()
    about: str = ""


class Configured(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    name: str
    about: str = ""


class Variable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A variable of the plant; with `entries` the variables `name[1]` to `name[entries]`, of which it has some."""

    name: str
    unit: str = ""
    entries: int = 0
    about: str = ""

    @property
    def variables(self) -> list[str]:
        return [f"{self.name}[{k + 1}]" for k in range(self.entries)] if self.entries else [self.name]


class Counter(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    name: str
    about: str = ""


class Signal(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """With `sensor` or `actuator` the board reads the value at each sample instant, otherwise `board_record` sets it.

    `count` names a parameter, the number of signals: the first entries of the sensor or actuator, called `name` if it
    is 1 and otherwise `name` with 1, 2, ... behind it.
    """

    name: str
    unit: str = "1"
    sensor: str = ""
    actuator: str = ""
    count: str = ""
    about: str = ""


class Event(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    name: str
    level: Literal["info", "warning"] = "info"
    about: str = ""


class Firmware(msgspec.Struct, frozen=True, forbid_unknown_fields=True, dict=True):
    """The content of one firmware.toml."""

    name: str
    about: str = ""
    companion: str = ""
    mavlink: str = ""
    ports: tuple[Port, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    configuration: tuple[Configured, ...] = ()
    sensors: tuple[Variable, ...] = ()
    actuators: tuple[Variable, ...] = ()
    counters: tuple[Counter, ...] = ()
    signals: tuple[Signal, ...] = ()
    events: tuple[Event, ...] = ()

    @cached_property
    def parameter_names(self) -> list[str]:
        """Names by number: the scenario's parameters, then those that the companion configures."""
        return [*(row.name for row in self.parameters), *(row.name for row in self.configuration)]

    @cached_property
    def sensor_names(self) -> list[str]:
        """The plant's variables by number of the sensor."""
        return [name for row in self.sensors for name in row.variables]

    @cached_property
    def actuator_names(self) -> list[str]:
        return [name for row in self.actuators for name in row.variables]


def read_description(folder: Path) -> Firmware:
    """Return the content of the folder's firmware.toml; raises FirmwareError with the file, the place and a remedy."""
    file = folder / TABLE
    try:
        table = tomllib.loads(file.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        raise FirmwareError(f"{folder}: no firmware there: a firmware is a folder with {TABLE} and C files; "
                            "`marconet firmware new FOLDER` writes one") from None
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise FirmwareError(f"{file}: {error}") from None
    try:
        firmware = msgspec.convert(table, Firmware)
    except msgspec.ValidationError as error:
        found = _PLACE.match(str(error))
        assert found is not None
        raise FirmwareError(f"{file}: {found[2] or 'top level'}: {found[1]}") from None
    for place, complaint in _complaints(firmware):
        raise FirmwareError(f"{file}: {place}: {complaint}")
    return firmware


def identifier(name: str) -> str:
    """Return the name as a part of a C macro: letters and digits in capitals, anything between them as one `_`."""
    return re.sub(r"[^A-Z0-9]+", "_", name.upper()).strip("_")


def _complaints(firmware: Firmware) -> Iterable[tuple[str, str]]:
    if not re.fullmatch(r"[a-z][a-z0-9_]*", firmware.name):
        yield f"name={firmware.name!r}", "expected small letters, digits and _, as the files that it names are"
    named: dict[str, tuple[Any, ...]] = {
        "ports": firmware.ports, "sensors": firmware.sensors, "actuators": firmware.actuators,
        "counters": firmware.counters, "signals": firmware.signals, "events": firmware.events,
        "parameters": (*firmware.parameters, *firmware.configuration)}
    for section, rows in named.items():
        taken: dict[str, str] = {}
        for row in rows:
            word = identifier(row.name)
            if not word:
                yield f"{section}: name={row.name!r}", "expected a letter or a digit in it, for its macro in C"
            if word in taken:
                yield f"{section}: name={row.name!r}", (
                    f"its macro in C is the same as that of {taken[word]!r}: give it another name")
            taken[word] = row.name
    for parameter in firmware.parameters:
        yield from _parameter_complaints(parameter)
    for kind, variables in (("sensors", firmware.sensors), ("actuators", firmware.actuators)):
        for row in variables:
            if not 0 <= row.entries <= MOST_ENTRIES:
                yield f"{kind}: {row.name}: entries={row.entries}", f"expected 0, no array, to {MOST_ENTRIES}"
    for signal in firmware.signals:
        yield from _signal_complaints(signal, firmware)


def _parameter_complaints(parameter: Parameter) -> Iterable[tuple[str, str]]:
    place, default = f"parameters: {parameter.name}", parameter.default
    if not parameter.name.isidentifier():
        yield place, "expected a name of letters, digits and _, since it is a key of a scenario"
    if (parameter.type == "rows") != (parameter.columns > 0):
        yield place, f"columns={parameter.columns}: expected 1 or more for type \"rows\", none for other types"
    if (parameter.type == "choice") != bool(parameter.choices):
        yield place, f"choices={list(parameter.choices)}: expected words for type \"choice\", none for other types"
    fits = {"float": isinstance(default, int | float) and not isinstance(default, bool),
            "int": isinstance(default, int | float) and not isinstance(default, bool) and default == int(default),
            "bool": isinstance(default, bool),
            "floats": isinstance(default, list) and not any(isinstance(value, list) for value in default),
            "rows": isinstance(default, list) and all(isinstance(row, list) and len(row) == parameter.columns
                                                      for row in default),
            "choice": default in parameter.choices}
    if default is not None and not fits[parameter.type]:
        yield place, f"default={default!r}: expected one of type \"{parameter.type}\""


def _signal_complaints(signal: Signal, firmware: Firmware) -> Iterable[tuple[str, str]]:
    place = f"signals: {signal.name}"
    if signal.sensor and signal.actuator:
        yield place, f"sensor={signal.sensor!r}, actuator={signal.actuator!r}: expected at most one of them"
    for kind, name, rows in (("sensor", signal.sensor, firmware.sensors),
                             ("actuator", signal.actuator, firmware.actuators)):
        if name and name not in [row.name for row in rows]:
            yield place, f"{kind}={name!r}: no such {kind}: expected one of {', '.join(row.name for row in rows)}"
    if signal.count and signal.count not in firmware.parameter_names:
        yield place, f"count={signal.count!r}: no such parameter"
    if signal.count and not (signal.sensor or signal.actuator):
        yield place, "count: expected a sensor or an actuator with it, whose entries are the signals"
