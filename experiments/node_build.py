"""From a node's specification to the node: its program, clock, plant and ports. The same function for both hosts.

A robot's process imports this and what its program needs, nothing else: no scenario, no records, no report.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from experiments.own_modules import class_for
from firmware_sim.board import Board
from firmware_sim.local_clock import ClockSettings, LocalClock
from fmus.description import PlantDescription
from fmus.plant import Plant
from netem.node import Node
from netem.random_streams import stream


class PlantSpecification(msgspec.Struct, frozen=True):
    description: PlantDescription
    start: dict[str, float | bool | str]


class NodeSpecification(msgspec.Struct, frozen=True):
    """Everything a process needs to become this node."""

    name: str
    program: str                    # "package.module:Class"
    parameters: dict[str, Any]
    media: tuple[str, ...]
    clock: ClockSettings
    plant: PlantSpecification | None
    team: Mapping[str, Any]
    sample_period_ns: int
    seed: int
    folder: str                     # where the scenario's own programs may lie


def build_node(specification: NodeSpecification) -> Node:
    """The node, its program constructed and started."""
    node = Node(specification.name, specification.media, specification.sample_period_ns)
    clock = LocalClock(specification.clock, node.env.time_ns)
    plant = None
    if specification.plant is not None:
        plant = Plant(specification.plant.description, specification.name, specification.plant.start)
    board = Board(node, clock, plant, specification.team, stream(specification.seed, f"agents.{specification.name}"))
    program = class_for(specification.program, Path(specification.folder))(board, **specification.parameters)
    if hasattr(program, "run"):
        node.start(program.run())
    return node
