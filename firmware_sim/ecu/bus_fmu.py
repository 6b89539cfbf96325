"""A control unit that is an FMU: its bus terminals are ports on CAN buses of the scenario.

    Tx_Clock ticks --> Tx_Data --operations--> frames on the bus, its controller
    frame, or message of the controller --operations--> Rx_Clock ticks with Rx_Data

The bus is marconet's: arbitration, stuff bits, errors and retransmission. What the FMU transmits is queued at the
instant at which its Tx_Clock ticks. With `notifications_to` of the bus it learns of each frame when it got through
(Confirm), lost arbitration if it asked to be told (Arbitration Lost) or was destroyed (Bus Error).

Not supported: CAN XL, bit rates other than the bus's, sleep, an FMU that is killed and goes on.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Final

from firmware_sim.board import Board
from firmware_sim.ecu import operations
from firmware_sim.ecu.operations import (
    Behavior,
    Configuration,
    FormatError,
    Misshapen,
    NodeStatus,
    Operation,
    Parameter,
    Status,
    Transmit,
)
from firmware_sim.scenario_view import Own, ScenarioView
from fmus.description import BusTerminal, PlantDescription
from netem.media.can import controller_message
from netem.media.can.controller_message import CAUSES, ControllerMessage, Kind
from netem.media.can.error_frame import Cause
from netem.media.can.frame import MalformedFrame, pack, unpack

BUSES: Final = "can_buses"          # keys of the team's table
NOTIFIED: Final = "can_notifies"
MOST_ANSWERS: Final = 1_000         # Format Errors in a row at one instant
CODES: Final = {Cause.BIT: 0x01, Cause.STUFF: 0x02, Cause.FORM: 0x03, Cause.ACK: 0x05}


@dataclass(frozen=True)
class BusFmuSettings:
    """`terminals` maps bus terminals to CAN buses; needed unless their names are equal or there is one of each."""

    terminals: dict[str, str] = field(default_factory=dict)
    step_ns: int = 0                # steps of an FMU with a triggered Tx_Clock, true time; 0: only where it must

    def __post_init__(self) -> None:
        if self.step_ns < 0:
            raise ValueError(f"step_ns={self.step_ns}: expected 0 or more")


def buses_of(terminals: Iterable[str], buses: Sequence[str], given: Mapping[str, str]) -> dict[str, str]:
    """Return the CAN bus of each terminal; raises ValueError with what is missing."""
    terminals = tuple(terminals)
    for name, bus in given.items():
        if name not in terminals:
            raise ValueError(f"terminals.{name}: the FMU has no such bus terminal; it has {', '.join(terminals)}")
        if bus not in buses:
            raise ValueError(f"terminals.{name}={bus}: no CAN bus of this agent; there are "
                             f"{', '.join(buses) or 'none'}")
    found = {name: given.get(name, name) for name in terminals}
    if not given and len(terminals) == len(buses) == 1:
        found = {terminals[0]: buses[0]}
    for name, bus in found.items():
        if bus not in buses:
            raise ValueError(f"the bus terminal {name} is on no CAN bus; write parameters.terminals = {{ {name} = "
                             f"\"{buses[0] if buses else 'BUS'}\" }}")
    if len(set(found.values())) < len(found):
        raise ValueError("two bus terminals are on one CAN bus; give each its own")
    return found


class BusFmu:
    Settings: ClassVar = BusFmuSettings
    handles_events: ClassVar = True         # its plant is in event mode

    @classmethod
    def check(cls, scenario: ScenarioView, own: Own[BusFmuSettings]) -> Iterator[str]:
        for name, agent in own.items():
            if agent.agent.plant is None:
                yield f"agents.{name}: BusFmu runs an FMU with a bus terminal; write plant = {{ fmu = \"ecu.fmu\" }}"
                continue
            description = _described(agent.agent.plant.fmu)
            if description is None or complaint(description):
                yield (f"agents.{name}.plant: fmu={agent.agent.plant.fmu}: "
                       f"{'it has no bus terminal' if description is None else complaint(description)}")
                continue
            buses = [medium for medium in agent.media if scenario.media[medium].settings.carries_can_frames]
            try:
                buses_of((each.name for each in description.bus_terminals), buses, agent.settings.terminals)
            except ValueError as error:
                yield f"agents.{name}.parameters: {error}"
            if not agent.settings.step_ns and (late := _triggered(description)):
                yield (f"agents.{name}.parameters: step_ms is missing: {late} is a triggered output, so the FMU sends "
                       "only at the end of a step; say how long its steps are")

    @classmethod
    def prepare(cls, scenario: ScenarioView, own: Own[BusFmuSettings]) -> dict[str, Any]:
        """Tell the bit rates [bit/s] of all CAN buses, (nominal, data), and which nodes they notify."""
        return {BUSES: {name: (medium.settings.bit_rate_bps, medium.settings.data_bit_rate_bps)
                        for name, medium in scenario.media.items() if medium.settings.carries_can_frames},
                NOTIFIED: {name: [medium for medium in agent.media if scenario.media[medium].settings.notifies(name)]
                           for name, agent in own.items()}}

    def __init__(self, board: Board, settings: BusFmuSettings) -> None:
        self._board, self._step_ns = board, settings.step_ns
        self._plant = plant = board.event_plant()
        self._notified: Sequence[str] = board.team[NOTIFIED][board.name]
        rates: Mapping[str, tuple[int, int | None]] = board.team[BUSES]
        terminals = {each.name: each for each in plant.description.bus_terminals}
        buses = buses_of(terminals, [port for port in board.ports if port in rates], settings.terminals)
        self._channels = {terminals[name].tx_data: _Channel(self, terminals[name], bus, rates[bus])
                          for name, bus in buses.items()}
        self._armed_ns = -1
        board.after(0, self._pump)
        if self._step_ns:
            board.after(self._step_ns, self._poll)

    @property
    def board(self) -> Board:
        return self._board

    def notified(self, bus: str) -> bool:
        """Return whether the controller on `bus` tells this node about single frames, and is told by it."""
        return bus in self._notified

    def deliver(self, terminal: BusTerminal, operation: bytes) -> None:
        """Hand an operation to the FMU at the present, and do what it says to it."""
        self._plant.deliver(terminal.rx_clock, terminal.rx_data, operation)
        self._pump()

    def answer(self, terminal: BusTerminal, misshapen: bytes) -> None:
        most = self._plant.description.variable(terminal.rx_data).most_bytes
        self._plant.deliver(terminal.rx_clock, terminal.rx_data, operations.format_error(misshapen, most))

    def _pump(self) -> None:
        """Do what the FMU has put out, until it puts out no more, and wait for its next event."""
        self._plant.come_to_present()
        for _ in range(MOST_ANSWERS):
            found = self._plant.take_outgoing()
            if not found:
                break
            for time_ns, variable, value in found:
                if (channel := self._channels.get(variable)) is not None:
                    channel.take(value, late=time_ns < self._plant.now_ns)
        else:
            raise RuntimeError(f"the FMU answered {MOST_ANSWERS} times at one instant: it answers each Format Error "
                               "with another operation that is none")
        due_ns = self._plant.due_ns
        if due_ns is not None and due_ns != self._armed_ns:
            self._armed_ns = due_ns
            self._board.after(due_ns - self._plant.now_ns, partial(self._wake, due_ns))

    def _wake(self, due_ns: int) -> None:
        if due_ns == self._armed_ns:
            self._armed_ns = -1
            self._pump()

    def _poll(self) -> None:
        self._board.after(self._step_ns, self._poll)
        self._pump()


class _Channel:
    """One bus terminal and its port."""

    def __init__(self, unit: BusFmu, terminal: BusTerminal, bus: str, rates: tuple[int, int | None]) -> None:
        self._unit, self._terminal, self._bus, self._rates = unit, terminal, bus, rates
        self._port = unit.board.port(bus, self._hear)
        self._refused: set[str] = set()
        for name in ("transmitted", "confirmed", "arbitration_lost", "bus_errors", "format_errors", "late"):
            unit.board.count(f"{bus}.{name}", 0)

    def take(self, value: bytes, *, late: bool) -> None:
        """Do the operations in a value of Tx_Data; `late` if its clock ticked before the present."""
        for operation in operations.decode(value):
            self._count("late", int(late))
            self._act(operation)

    def _act(self, operation: Operation) -> None:
        if isinstance(operation, Transmit):
            self._count("transmitted")
            self._port.send(pack(operation.frame))
        elif isinstance(operation, Misshapen):
            self._count("format_errors")
            self._warn_once("format error", operation.why)
            self._unit.answer(self._terminal, operation.data)
        elif isinstance(operation, FormatError):
            self._warn_once("format error told", f"the FMU does not understand {operation.data[:16].hex()}")
        elif isinstance(operation, Configuration):
            self._configure(operation)
        elif isinstance(operation, Status):
            self._unit.board.event("status", f"{self._bus}: {operation.status.name.lower().replace('_', '-')}")
            self._tell(ControllerMessage(Kind.STATUS, first=operation.status))
            if operation.status is NodeStatus.BUS_OFF:
                self._count("bus_off_told")
        else:
            self._tell(ControllerMessage(Kind.WAKEUP))

    def _configure(self, operation: Configuration) -> None:
        if operation.parameter is Parameter.ARBITRATION_LOST_BEHAVIOR:
            self._tell(ControllerMessage(Kind.ONE_SHOT, first=operation.value == Behavior.DISCARD_AND_NOTIFY))
            return
        known = {Parameter.CAN_BAUDRATE: self._rates[0], Parameter.CAN_FD_BAUDRATE: self._rates[1]}
        if operation.value != known.get(operation.parameter):
            self._warn_once("bit rate", f"the FMU asks for {operation.parameter.name} = {operation.value} bit/s, the "
                            f"bus {self._bus} has {known.get(operation.parameter) or 'none'}: the scenario decides")

    def _hear(self, data: bytes) -> None:
        """Hand a frame, or a message of the controller, to the FMU."""
        try:
            frame = unpack(data)
        except MalformedFrame:
            return
        if not frame.error:
            self._unit.deliver(self._terminal, operations.transmit(frame))
            return
        message = controller_message.decode(frame)
        if message is None:
            return
        if message.kind is Kind.CONFIRM:
            self._count("confirmed")
            operation = operations.confirm(message.can_id)
        elif message.kind is Kind.LOST:
            self._count("arbitration_lost")
            operation = operations.arbitration_lost(message.can_id)
        elif message.kind is Kind.BUS_ERROR:
            self._count("bus_errors")
            operation = operations.bus_error(message.can_id, CODES[CAUSES[message.first]],
                                             primary=message.second == 1, is_sender=message.third == 1)
        else:
            operation = operations.wakeup()
        self._unit.deliver(self._terminal, operation)

    def _tell(self, message: ControllerMessage) -> None:
        if self._unit.notified(self._bus):
            self._port.send(controller_message.encode(message))
        else:
            self._warn_once("not told to the bus", f"{message.kind.name.lower()}: name this node in notifications_to "
                            f"of [media.{self._bus}]")

    def _count(self, name: str, by: int = 1) -> None:
        self._unit.board.count(f"{self._bus}.{name}", by)

    def _warn_once(self, kind: str, detail: str) -> None:
        if kind not in self._refused:
            self._refused.add(kind)
            self._unit.board.warn(kind, f"{self._bus}: {detail}")


def _described(fmu: str) -> PlantDescription | None:
    """Return the description of an FMU; None for one of marconet's models, none of which is on a bus."""
    from fmus.describe_fmu import describe  # imports FMPy, which a robot's process does not need

    return describe(Path(fmu)) if fmu.endswith(".fmu") else None


def complaint(description: PlantDescription) -> str:
    """Return why the FMU cannot be on a bus, "" if it can."""
    if description.bus_terminals_problem:
        return description.bus_terminals_problem
    if not description.bus_terminals:
        return "it has no bus terminal (terminalKind org.fmi-ls-bus.network-terminal in terminalsAndIcons.xml)"
    if not description.event_mode:
        return "it has no event mode (hasEventMode is not true), which the clocks of its bus terminal need"
    if not description.variable_step or description.fixed_step_s is not None:
        return "it has a fixed step, between whose multiples its clocks could not tick; export it with variable steps"
    return ""


def _triggered(description: PlantDescription) -> str:
    """Return the name of a Tx_Clock that is a triggered output, "" if none is."""
    return next((each.tx_clock for each in description.bus_terminals
                 if description.variables[each.tx_clock].causality == "output"), "")
