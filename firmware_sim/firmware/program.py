"""A firmware as a robot's program: what `marconet_board.h` promises, done with a `Board`.

    Board --timers, ports--> BoardCalls --board_timer, board_receive--> firmware
    firmware --Operation, Question--> BoardCalls --at, send, actuate--> Board

`firmware_class` makes the class of one firmware. Its `Settings` are the parameters that firmware.toml declares, its
`check` compares what the firmware names with the scenario and builds it. The companion, a class of the firmware's
author, may have static methods

    check(scenario, own), prepare(scenario, own)        as a program's (`scenario_view.py`)
    configure(team, name, settings)                     values of the rows [[configuration]] for the robot `name`

`configure` corresponds to what is written into a robot's memory before it is deployed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, make_dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Final, Literal

from firmware_sim.board import Board
from firmware_sim.firmware.board_calls import BoardCalls
from firmware_sim.firmware.build import FIRMWARE, build_for_host
from firmware_sim.firmware.description import Firmware, Parameter, Signal, Variable
from firmware_sim.firmware.errors import FirmwareError, FirmwareMistake
from firmware_sim.firmware.host.library import Library
from firmware_sim.firmware.plant_variables import readers, writers
from firmware_sim.scenario_view import Own, ScenarioView

TYPES: Final[Mapping[str, Any]] = {"float": float, "int": int, "bool": bool, "floats": list[float],
                                   "rows": list[list[float]]}


class FirmwareProgram:
    """One robot with a firmware, here on the host; subclasses have the firmware's `firmware` and `folder`."""

    firmware: ClassVar[Firmware]
    folder: ClassVar[Path]
    companion: ClassVar[Any] = None

    def __init__(self, board: Board, settings: Any) -> None:
        self._board = board
        firmware = self.firmware
        self._read = [read for row in firmware.sensors for read in readers(board, row)]
        write = [write for row in firmware.actuators for write in writers(board, row)]
        self._calls = BoardCalls(board, firmware, [medium_of(port.name, firmware, board.ports)
                                                   for port in firmware.ports], self._read, write)
        parameters = self._parameter_values(settings)
        self._library = library = self._load(parameters)
        self._calls.serve(library.timer, library.receive, library.bytes)
        board.at_end(self._library.close)
        for counter in firmware.counters:
            board.count(counter.name, 0)
        signals = [signal for number, row in enumerate(firmware.signals)
                   for signal in self._signals(number, row, parameters)]
        board.record_all([(name, unit) for name, unit, _ in signals],
                         lambda: [read() for _, _, read in signals])
        if code := self._library.start():
            raise FirmwareMistake(f"{board.name}: board_start of {firmware.name} returned {code}: it refuses to start "
                                  "with these parameters; 0 means that it starts")

    def _load(self, parameters: Sequence[Sequence[float]]) -> Any:
        """Return the firmware as a Library, or as what a subclass runs it on, with the same functions."""
        return Library(build_for_host(self.folder), parameters, len(self.firmware.signals),
                       self._board.clock_reading(), self._calls, self.firmware.name, self._board.call_record,
                       ours=self.folder.parent == FIRMWARE)

    def _parameter_values(self, settings: Any) -> list[list[float]]:
        """Return the values of every parameter by its number."""
        firmware = self.firmware
        values = [_numbers(row, getattr(settings, row.name)) for row in firmware.parameters]
        if firmware.configuration:
            given: Mapping[str, Any] = self.companion.configure(self._board.team, self._board.name, settings)
            names = [row.name for row in firmware.configuration]
            if sorted(given) != sorted(names):
                raise ValueError(f"{firmware.companion}.configure gave {', '.join(sorted(given))}: expected rows of "
                                 f"[[configuration]] in {self.folder / 'firmware.toml'}: {', '.join(sorted(names))}")
            values += [_flat(given[name]) for name in names]
        return values

    def _signals(self, number: int, row: Signal,
                 parameters: Sequence[Sequence[float]]) -> Iterator[tuple[str, str, Callable[[], Any]]]:
        firmware = self.firmware
        if not (row.sensor or row.actuator):
            yield row.name, row.unit, partial(self._library.signals.__getitem__, number)
            return
        rows, name = (firmware.sensors, row.sensor) if row.sensor else (firmware.actuators, row.actuator)
        first, _ = _place(rows, name)
        count = int(parameters[firmware.parameter_names.index(row.count)][0]) if row.count else 1
        for k in range(count):
            read = self._read[first + k] if row.sensor else partial(self._calls.written.__getitem__, first + k)
            yield f"{row.name}{k + 1 if count > 1 else ''}", row.unit, read


def firmware_class(firmware: Firmware, folder: Path, companion: Any = None,
                   target: type[FirmwareProgram] = FirmwareProgram, build: Callable[[Path], Path] = build_for_host,
                   ) -> type[FirmwareProgram]:
    """Return the program class of a firmware, a subclass of `target`; its `check` builds the firmware by `build`.

    `companion` is the class that its firmware.toml names."""
    def check(scenario: ScenarioView, own: Own[Any]) -> Iterator[str]:
        yield from _problems(firmware, own)
        try:
            build(folder)
        except FirmwareError as error:
            yield str(error)
        if (more := getattr(companion, "check", None)) is not None:
            yield from more(scenario, own)

    members: dict[str, Any] = {"firmware": firmware, "folder": folder, "companion": companion,
                               "Settings": _settings(firmware), "check": staticmethod(check)}
    if (prepare := getattr(companion, "prepare", None)) is not None:
        members["prepare"] = staticmethod(prepare)
    return type(firmware.name, (target,), members)


def medium_of(port: str, firmware: Firmware, media: Sequence[str]) -> str:
    """Return the medium of a port: that of its name, or the only medium of the robot for the only port."""
    return media[0] if len(firmware.ports) == len(media) == 1 else port


def _problems(firmware: Firmware, own: Own[Any]) -> Iterator[str]:
    """Yield what the firmware names and its robots lack."""
    for name, agent in own.items():
        for port in firmware.ports:
            if medium_of(port.name, firmware, agent.media) not in agent.media:
                yield (f"agents.{name}.firmware: {firmware.name} has a port {port.name!r}, but the robot is on "
                       f"{', '.join(agent.media) or 'no medium'}: give the medium this name, or the port that of the "
                       "medium, in firmware.toml")
        if (firmware.sensors or firmware.actuators) and not agent.has_plant:
            yield (f"agents.{name}.firmware: {firmware.name} has sensors or actuators, but the robot has no plant: "
                   f"give it one, as agents.{name}.plant = {{ fmu = \"...\" }}")


def _settings(firmware: Firmware) -> type:
    """Return a dataclass with the firmware's parameters, which refuses values outside their limits."""
    def refuse(self: Any) -> None:
        for row in firmware.parameters:
            for value in _numbers(row, getattr(self, row.name)):
                if (row.min is not None and value < row.min) or (row.max is not None and value > row.max):
                    raise ValueError(f"{row.name}={getattr(self, row.name)}: expected {_limits(row)}")

    required = [(row.name, _type(row)) for row in firmware.parameters if row.default is None]
    optional = [(row.name, _type(row), _default(row)) for row in firmware.parameters if row.default is not None]
    return make_dataclass(f"{firmware.name}_settings", [*required, *optional], frozen=True,
                          namespace={"__post_init__": refuse})


def _type(row: Parameter) -> Any:
    return Literal[row.choices] if row.type == "choice" else TYPES[row.type]


def _default(row: Parameter) -> Any:
    if isinstance(row.default, list):
        return field(default_factory=partial(list, row.default))
    return field(default=row.default if row.type == "choice" else TYPES[row.type](row.default))


def _limits(row: Parameter) -> str:
    if row.min is not None and row.max is not None:
        return f"{row.min:g} to {row.max:g}"
    return f"at least {row.min:g}" if row.min is not None else f"at most {row.max:g}"


def _numbers(row: Parameter, value: Any) -> list[float]:
    """Return what the firmware reads of a parameter."""
    return [float(row.choices.index(value))] if row.type == "choice" else _flat(value)


def _flat(value: Any) -> list[float]:
    """Return numbers and nested lists of them as one list."""
    if isinstance(value, list | tuple):
        return [number for entry in value for number in _flat(entry)]
    return [float(value)]


def _place(rows: Sequence[Variable], name: str) -> tuple[int, Variable]:
    """Return the number of the first entry of a sensor or an actuator, and its row."""
    number = 0
    for row in rows:
        if row.name == name:
            return number, row
        number += len(row.variables)
    raise AssertionError(f"{name} was checked when firmware.toml was read")
