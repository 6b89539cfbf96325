"""A node with an emulated Cortex-M, without a scenario."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import Any

from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.cortex_m.program import CortexM, CortexMSettings
from firmware_sim.local_clock import LocalClock
from firmware_sim.processor import Processor
from netem.node.node import Node
from netem.wire.messages import Grant

ARRIVAL = tuple[int, int, bytes]            # instant, port, bytes
SAMPLE_PERIOD_NS = 5_000_000


def board_node(image: Path, ports: tuple[str, ...] = ("radio",), debug_port: int = 0, **settings: Any) -> Node:
    node, processor = Node("r1", ports, SAMPLE_PERIOD_NS), Processor()
    node.at_fault("slow", processor.slow_down)
    board = Board(node, LocalClock(ClockSettings(), lambda: node.now_ns), None, {}, Random(1), {}, processor,
                  debug_port=debug_port, can_buses=("bus",), byte_streams=("line",))
    board.keep_promises()
    CortexM(board, CortexMSettings(image=image, **settings))
    node.hello()
    return node


def offers(node: Node, until_ns: int, arrivals: list[ARRIVAL] | None = None) -> list[tuple[int, int, bytes]]:
    """Return (instant, port, bytes) of the frames that the node sends before `until_ns`."""
    return node.advance(Grant(1, until_ns, False, False, arrivals or [])).offers
