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

from experiments.own_modules import class_for
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from fmus.call_record import CallRecord
from fmus.description import PlantDescription
from fmus.plant import Plant
from netem.media.sensing.sight import Body, pack_body
from netem.node import Node
from netem.random_streams import stream


class PlantSpecification(msgspec.Struct, frozen=True):
    description: PlantDescription
    start: dict[str, float | bool | str]


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
    media: dict[str, str]           # its ports and the kind of the medium at each
    clock: ClockSettings
    plant: PlantSpecification | None
    team: Mapping[str, Any]
    sample_period_ns: int
    seed: int
    folder: str                     # where the scenario's own programs may lie
    blocking: bool = False
    own_frames: tuple[str, ...] = ()    # the media that tell it when its own frames got through
    shown: tuple[Shown, ...] = ()       # where it is seen


def build_node(specification: NodeSpecification, at_end: ExitStack | None = None,
               record: CallRecord | None = None) -> Node:
    """The node, its program constructed and started.

    `at_end` is closed when its process ends; on the host without processes there is none. `record` is told which FMI
    call of its plant runs.
    """
    if specification.blocking:
        return _blocking_node(specification, at_end, record)
    node = Node(specification.name, list(specification.media), specification.sample_period_ns)
    program = class_for(specification.program, Path(specification.folder))(_board(specification, node, record),
                                                                           **specification.parameters)
    if hasattr(program, "run"):
        node.start(program.run())
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

    node = BlockingNode(specification.name, list(specification.media), specification.sample_period_ns)
    folder = Path(specification.folder)
    at_end.enter_context(own_process(node, _board(specification, node, record), specification.program, folder,
                                     partial(class_for, specification.program, folder), specification.parameters,
                                     specification.media, specification.own_frames))
    return node


def _board(specification: NodeSpecification, node: Node, record: CallRecord | None) -> Board:
    clock = LocalClock(specification.clock, node.env.time_ns)
    plant = None
    if specification.plant is not None:
        plant = Plant(specification.plant.description, specification.name, specification.plant.start,
                      record=record)
        for shown in specification.shown:
            _show(node, plant, shown)
    return Board(node, clock, plant, specification.team, stream(specification.seed, f"agents.{specification.name}"))
