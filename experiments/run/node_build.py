"""Builds a node from its specification, with program, clock, plant and ports, for both hosts.

A class is a board's program; any other callable is ordinary blocking code (`firmware_sim/blocking`). A robot's process
imports this module and the modules of its program, but no scenario, records or report.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any, Final

import msgspec

from experiments.programs.firmware_programs import class_for
from experiments.programs.own_modules import copies_for
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from firmware_sim.processor import Processor
from firmware_sim.program_settings import construct_program
from firmware_sim.recorded_outputs import record_outputs
from firmware_sim.sockets.interface import Interface
from firmware_sim.zenoh_programs.specification import ZenohSpecification
from fmus.call_record import CallRecord
from fmus.description import PlantDescription
from fmus.event_plant import EventPlant
from fmus.input_faults import Change
from fmus.plant import Plant
from netem.core.random_streams import stream
from netem.node.named import Named
from netem.node.node import Node
from netem.node.outside_guard import guarded
from netem.wire.instants import NEVER_NS
from netem.wire.messages import Life

NOTIFICATIONS: Final = "org.fmi_standard.fmi_ls_bus.Can_BusNotifications"   # parameter of an FMU with a bus terminal
NOISE_SEED: Final = "noise_seed"        # parameter of a plant with a random path; drawn unless the scenario sets it


class PlantSpecification(msgspec.Struct, frozen=True):
    description: PlantDescription
    start: dict[str, Any]
    step_ns: int | None = None          # step of an FMU with a fixed step that its description does not name
    idle_outputs: list[str] = []        # outputs that are always 0 and are not recorded


class Shown(msgspec.Struct, frozen=True):
    """Outputs of this node's plant that `medium` reads at 0, period, 2 period, ..."""

    medium: str
    period_ns: int
    outputs: tuple[str, ...]


class NodeSpecification(msgspec.Struct, frozen=True):
    """All data from which a process builds this node."""

    name: str
    program: str                    # "package.module:Class", or ":function" if it is blocking
    parameters: dict[str, Any]
    media: tuple[str, ...]          # also the names of its ports
    clock: ClockSettings
    plant: PlantSpecification | None
    team: Mapping[str, Any]
    sample_period_ns: int
    seed: int
    folder: str                     # folder of the scenario and of programs beside it
    blocking: bool = False
    own_frames: tuple[str, ...] = ()    # media that deliver the node's own frames once they got through
    notified: bool = False          # a medium tells the node how each frame went that it sent
    can_buses: tuple[str, ...] = ()     # media that python-can opens
    shown: tuple[Shown, ...] = ()       # media that read outputs of its plant
    mortal: bool = False                # a fault may kill it
    handles_events: bool = False        # its program handles the events and clocks of its plant
    zenoh: ZenohSpecification | None = None     # for its program's Zenoh, None for a board's program
    interfaces: tuple[Interface, ...] = ()      # media that its sockets use
    byte_streams: tuple[str, ...] = ()  # media that carry single bytes in order
    debug_port: int = 0                 # TCP port where its emulated processor awaits a debugger, 0: none


class State(msgspec.Struct):
    """The state of a killed node's plant, clock and processor, with which its next life goes on."""

    plant: bytes | None
    clock: tuple[str, str, str]         # of `LocalClock.kept`
    slowed_by: list[float]              # factors of its execution times


def build_node(specification: NodeSpecification, at_end: ExitStack | None = None, record: CallRecord | None = None,
               life: Life | None = None, *, own_process: bool = True) -> Node:
    """Return the node with its program constructed and started.

    `at_end` is closed at the end of the run, in the node's process or, without `own_process`, in that of all nodes;
    then a blocking program gets copies of the modules of its folder. `record` receives the FMI call
    of the plant that runs, or the function of the firmware. With a `life` the node was killed: its plant goes on,
    and its program starts when it boots.
    """
    if specification.blocking:
        from firmware_sim.blocking.node import BlockingNode

        kind: type[Node] = BlockingNode
    else:
        kind = Node
    node = kind(specification.name, specification.media, specification.sample_period_ns, life)
    clock = LocalClock(specification.clock, node.present_ns)
    processor = Processor()
    plant = _plant(specification, node, record)
    _take_faults(node, plant, clock, processor)
    begin = partial(_begin, specification, node, clock, processor, plant, at_end, 0 if life is None else life.number,
                    own_process, record)
    if life is None:
        begin()
        return node
    _resume(plant, clock, processor, life)
    if plant is not None and specification.plant is not None:
        record_outputs(node, plant, specification.plant.idle_outputs, among=life.signals)
    if life.boots_ns < NEVER_NS:
        node.call_in(life.boots_ns - life.from_ns, lambda event: _boot(node, life, clock, begin))
    return node


def _take_faults(node: Node, plant: Plant | None, clock: LocalClock, processor: Processor) -> None:
    """Let faults act in the node that need no program; a board's own acts on its clock replace those here."""
    node.at_fault("kill", partial(_leave, plant, clock, processor))
    node.at_fault("clock_step", lambda fields: clock.adjust(fields["by_ns"]))
    node.at_fault("clock_drift", lambda fields: clock.drift(fields["by_ppm"]))
    node.at_fault("slow", processor.slow_down)
    if plant is not None:
        node.at_fault("plant_input", lambda fields: plant.change_input(
            fields["variable"], Change(fields["how"], fields["by"]), fields["begins"]))
        node.at_fault("plant_parameter", lambda fields: plant.change(
            fields["variable"], Change(fields["how"], fields["by"])))


def _begin(specification: NodeSpecification, node: Node, clock: LocalClock, processor: Processor, plant: Plant | None,
           at_end: ExitStack | None, life: int, own_process: bool, record: CallRecord | None) -> None:
    """Construct and start the program; record what it declares and the outputs of its plant."""
    board = _board(specification, node, clock, processor, plant, life, record)
    if specification.blocking:
        assert at_end is not None, "blocking code has threads that somebody has to end"
        board.take_faults([_begin_blocking(specification, node, board, at_end, 0 if own_process else life + 1)])
    else:
        board.take_faults()
        board.keep_promises()
        program = construct_program(class_for(specification.program, Path(specification.folder)), board,
                                    specification.parameters)
        if hasattr(program, "run"):
            running = program.run()
            if not hasattr(running, "throw"):
                raise TypeError(f"{type(program).__name__}.run() gave {running!r}: expected a generator; write `run` "
                                "with `yield from self.board.sleep_until(local_ns)` in it")
            board.start(running)
    if plant is not None and specification.plant is not None:
        record_outputs(node, plant, specification.plant.idle_outputs)


def _leave(plant: Plant | None, clock: LocalClock, processor: Processor, fields: Mapping[str, Any]) -> bytes:
    """Return what outlives the node, which is about to be killed."""
    state = State(None if plant is None else plant.state(), clock.kept(), processor.factors)
    if plant is not None:
        plant.close()               # for an FMU of which a process can have only one
    return msgspec.msgpack.encode(state)


def _resume(plant: Plant | None, clock: LocalClock, processor: Processor, life: Life) -> None:
    """Let the plant, the clock and the processor go on from the node's last life."""
    state = msgspec.msgpack.decode(life.state, type=State)
    clock.resume(*state.clock)
    processor.resume(state.slowed_by)
    if plant is not None and state.plant is not None:
        plant.restore(state.plant)
        if plant.stopped is None:
            for name, value in life.fields.get("inputs_when_dead", {}).items():
                plant.set(name, value)


def _boot(node: Node, life: Life, clock: LocalClock, begin: Callable[[], None]) -> None:
    """Start the program of a node that was killed; what it starts with is as at the start of the run."""
    if life.fields.get("clock") == "reset":
        clock.reset()
    node.forget_signals()
    quiet = [port.index for port in node.ports.values() if port.listen_only]
    for port in node.ports.values():
        port.listen_only = False
    begin()
    if missing := [port.name for port in node.ports.values() if port.index in quiet and not port.listen_only]:
        raise ValueError(f"{node.name}: port {missing[0]!r} was `listen_only` before the node was killed: a program "
                         "opens its ports in the same way in each of its lives")


def _begin_blocking(specification: NodeSpecification, node: Any, board: Board, at_end: ExitStack,
                    copy: int) -> LocalClock:
    """Begin the function in its own thread; return the clock by which it measures durations.

    `copy` numbers the copies of its modules in a process that nodes share; 0: it has a process of its own.
    """
    from firmware_sim.blocking.ordinary_script import running_script

    folder = Path(specification.folder)
    find: Callable[[str], Any] = partial(class_for, folder=folder)
    if copy:
        from experiments.run.shared_state import shared_state_restored

        at_end.enter_context(shared_state_restored(folder))
        find = at_end.enter_context(copies_for(f"{specification.name}/{copy}", folder))
    program = at_end.enter_context(running_script(
        node, board, specification.clock, specification.program, folder,
        partial(_load_blocking, specification, at_end, find, not copy), specification.parameters,
        specification.can_buses, specification.own_frames, specification.interfaces, own_process=not copy))
    return program.oscillator


def _load_blocking(specification: NodeSpecification, at_end: ExitStack, find: Callable[[str], Any],
                   own_process: bool) -> Any:
    """Return the function; called in its own thread, so that python-can is imported with virtual time and locks."""
    if specification.can_buses and guarded():
        from firmware_sim.can_interface.other_interfaces import only_our_interface

        at_end.enter_context(only_our_interface())
    if specification.zenoh is not None and guarded():
        from firmware_sim.zenoh_programs.replaced import zenoh_in_virtual_time

        at_end.enter_context(zenoh_in_virtual_time(specification.zenoh, everywhere=not own_process))
    return find(specification.program)


def _plant(specification: NodeSpecification, node: Node, record: CallRecord | None) -> Plant | None:
    if specification.plant is None:
        return None
    start, description = specification.plant.start, specification.plant.description
    if NOISE_SEED in description.variables and NOISE_SEED not in start:
        rng = stream(specification.seed, f"agents.{specification.name}.plant")
        start = {**start, NOISE_SEED: int(rng.random() * 2**31)}
    if NOTIFICATIONS in description.variables and NOTIFICATIONS not in start:
        start = {**start, NOTIFICATIONS: specification.notified}
    kind = EventPlant if specification.handles_events else Plant
    plant = kind(description, specification.name, start, specification.plant.step_ns, present=node.present_ns,
                 on_end=node.end_run, record=record, mortal=specification.mortal)
    for shown in specification.shown:
        node.show(shown.medium, shown.period_ns, plant.output_group(list(shown.outputs)).read)
    return plant


def _board(specification: NodeSpecification, node: Node, clock: LocalClock, processor: Processor,
           plant: Plant | None, life: int, record: CallRecord | None) -> Board:
    name = specification.name
    team = Named(specification.team, name, "key of [team]", "the scenario has no [team]")
    parameters = Named(specification.parameters, name, "parameter", f"agents.{name}.parameters is empty")
    place = f"agents.{name}/life {life}" if life else f"agents.{name}"
    return Board(node, clock, plant, team, stream(specification.seed, place), parameters,
                 processor, record, specification.debug_port, specification.can_buses, specification.byte_streams)
