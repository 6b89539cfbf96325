"""Builds a node from its specification, with program, clock, plant and ports, for both hosts.

A class is a board's program; any other callable is ordinary blocking code (`firmware_sim/blocking`), which needs a
process of its own. A robot's process imports this module and the modules of its program, but no scenario, records or
report.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import msgspec

from experiments.scenario.own_modules import class_for
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from firmware_sim.program_settings import construct_program
from firmware_sim.recorded_outputs import record_outputs
from fmus.call_record import CallRecord
from fmus.description import PlantDescription
from fmus.plant import Plant
from netem.core.random_streams import stream
from netem.node.named import Named
from netem.node.node import Node
from netem.node.outside_guard import guarded


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
    can_buses: tuple[str, ...] = ()     # media that python-can opens
    shown: tuple[Shown, ...] = ()       # media that read outputs of its plant


def build_node(specification: NodeSpecification, at_end: ExitStack | None = None,
               record: CallRecord | None = None) -> Node:
    """Return the node with its program constructed and started.

    `at_end` is closed at the end of the node's process; the host `inline` passes None. `record` receives the FMI call
    of the plant that runs.
    """
    if specification.blocking:
        return _blocking_node(specification, at_end, record)
    node = Node(specification.name, specification.media, specification.sample_period_ns)
    plant = _plant(specification, node, record)
    board = _board(specification, node, plant)
    board.keep_promises()
    program = construct_program(class_for(specification.program, Path(specification.folder)), board,
                                specification.parameters)
    if hasattr(program, "run"):
        running = program.run()
        if not hasattr(running, "throw"):
            raise TypeError(f"{type(program).__name__}.run() gave {running!r}: expected a generator; write `run` with "
                            "`yield from self.board.sleep_until(local_ns)` in it")
        node.start(running)
    if plant is not None and specification.plant is not None:
        record_outputs(node, plant, specification.plant.idle_outputs)
    return node


def _blocking_node(specification: NodeSpecification, at_end: ExitStack | None, record: CallRecord | None) -> Node:
    assert at_end is not None, "blocking code needs a process of its own"
    from firmware_sim.blocking.node import BlockingNode
    from firmware_sim.blocking.own_process import own_process

    node = BlockingNode(specification.name, specification.media, specification.sample_period_ns)
    plant, folder = _plant(specification, node, record), Path(specification.folder)
    board = _board(specification, node, plant)
    at_end.enter_context(own_process(node, board, specification.clock, specification.program, folder,
                                     partial(_load_blocking, specification, at_end), specification.parameters,
                                     specification.can_buses, specification.own_frames))
    if plant is not None and specification.plant is not None:
        record_outputs(node, plant, specification.plant.idle_outputs)
    return node


def _load_blocking(specification: NodeSpecification, at_end: ExitStack) -> Any:
    """Return the function; called in its own thread, so that python-can is imported with virtual time and locks."""
    if specification.can_buses and guarded():
        from firmware_sim.can_interface.other_interfaces import only_our_interface

        at_end.enter_context(only_our_interface(specification.name, specification.can_buses))
    return class_for(specification.program, Path(specification.folder))


def _plant(specification: NodeSpecification, node: Node, record: CallRecord | None) -> Plant | None:
    if specification.plant is None:
        return None
    plant = Plant(specification.plant.description, specification.name, specification.plant.start,
                  specification.plant.step_ns, present=node.present_ns, on_end=node.end_run, record=record)
    for shown in specification.shown:
        node.show(shown.medium, shown.period_ns, plant.output_group(list(shown.outputs)).read)
    return plant


def _board(specification: NodeSpecification, node: Node, plant: Plant | None) -> Board:
    name = specification.name
    team = Named(specification.team, name, "key of [team]", "the scenario has no [team]")
    parameters = Named(specification.parameters, name, "parameter", f"agents.{name}.parameters is empty")
    return Board(node, LocalClock(specification.clock, node.present_ns), plant, team,
                 stream(specification.seed, f"agents.{name}"), parameters)
