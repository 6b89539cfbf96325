"""From a node's specification to the node: its program, clock, plant and ports. The same function for both hosts.

A class is a board's program; any other callable is ordinary blocking code (`firmware_sim/blocking`), which needs a
process of its own. A robot's process imports this and what its program needs, nothing else: no scenario, no records,
no report.
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
from firmware_sim.recorded_outputs import record_outputs
from fmus.call_record import CallRecord
from fmus.description import PlantDescription
from fmus.plant import Plant
from netem.core.random_streams import stream
from netem.media.sensing.sight import Body, pack_body
from netem.node.named import Named
from netem.node.node import Node
from netem.node.outside_guard import guarded


class PlantSpecification(msgspec.Struct, frozen=True):
    description: PlantDescription
    start: dict[str, Any]
    step_ns: int | None = None          # of an FMU that takes steps of one size and does not say which
    idle_outputs: list[str] = []        # that are 0 for good: not recorded


class Shown(msgspec.Struct, frozen=True):
    """A medium that sees this node's plant at every exposure."""

    medium: str
    period_ns: int
    outputs: tuple[str, ...]            # x, y, heading or x, y, z, heading


class NodeSpecification(msgspec.Struct, frozen=True):
    """Everything a process needs to become this node."""

    name: str
    program: str                    # "package.module:Class", or ":function" if it is blocking
    parameters: dict[str, Any]
    media: tuple[str, ...]          # its ports are named like these
    clock: ClockSettings
    plant: PlantSpecification | None
    team: Mapping[str, Any]
    sample_period_ns: int
    seed: int
    folder: str                     # where the scenario's own programs may lie
    blocking: bool = False
    own_frames: tuple[str, ...] = ()    # the media that tell it when its own frames got through
    can_buses: tuple[str, ...] = ()     # the media that python-can opens
    shown: tuple[Shown, ...] = ()       # where it is seen


def build_node(specification: NodeSpecification, at_end: ExitStack | None = None,
               record: CallRecord | None = None) -> Node:
    """The node, its program constructed and started.

    `at_end` is closed when its process ends; on the host without processes there is none. `record` is told which FMI
    call of its plant runs.
    """
    if specification.blocking:
        return _blocking_node(specification, at_end, record)
    node = Node(specification.name, specification.media, specification.sample_period_ns)
    board = _board(specification, node, record)
    program = class_for(specification.program, Path(specification.folder))(board, **specification.parameters)
    if hasattr(program, "run"):
        running = program.run()
        if not hasattr(running, "throw"):
            raise TypeError(f"{type(program).__name__}.run() gave {running!r}: expected a generator; write `run` with "
                            "`yield from self.board.wait_until(local_ns)` in it")
        node.start(running)
    if board.plant is not None and specification.plant is not None:
        record_outputs(node, board.plant, specification.plant.idle_outputs)
    return node


def _show(node: Node, plant: Plant, shown: Shown) -> None:
    group = plant.output_group(list(shown.outputs))

    def pose(true_ns: int) -> bytes:
        plant.advance_to(true_ns)
        values = group.read()
        return pack_body(Body(*values) if len(values) == 4 else Body(values[0], values[1], 0.0, values[2]))

    node.show(shown.medium, shown.period_ns, pose)


def _blocking_node(specification: NodeSpecification, at_end: ExitStack | None, record: CallRecord | None) -> Node:
    assert at_end is not None, "blocking code needs a process of its own"
    from firmware_sim.blocking.node import BlockingNode
    from firmware_sim.blocking.own_process import own_process

    node = BlockingNode(specification.name, specification.media, specification.sample_period_ns)
    board, folder = _board(specification, node, record), Path(specification.folder)
    at_end.enter_context(own_process(node, board, specification.program, folder,
                                     partial(_load_blocking, specification, at_end), specification.parameters,
                                     specification.can_buses, specification.own_frames))
    if board.plant is not None and specification.plant is not None:
        record_outputs(node, board.plant, specification.plant.idle_outputs)
    return node


def _load_blocking(specification: NodeSpecification, at_end: ExitStack) -> Any:
    """The function. Its own thread calls this: python-can, imported here, has to find the node's time and locks."""
    if specification.can_buses and guarded():
        from firmware_sim.can_interface.other_interfaces import only_our_interface

        at_end.enter_context(only_our_interface(specification.name, specification.can_buses))
    return class_for(specification.program, Path(specification.folder))


def _board(specification: NodeSpecification, node: Node, record: CallRecord | None) -> Board:
    clock = LocalClock(specification.clock, node.env.time_ns)
    plant = None
    if specification.plant is not None:
        plant = Plant(specification.plant.description, specification.name, specification.plant.start,
                      specification.plant.step_ns, present=node.present_ns, on_end=node.end_run, record=record)
        for shown in specification.shown:
            _show(node, plant, shown)
    team = Named(specification.team, specification.name, "key of [team]", "the scenario has no [team]")
    return Board(node, clock, plant, team, stream(specification.seed, f"agents.{specification.name}"))
