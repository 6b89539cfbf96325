"""A board on a node by itself: its clock, what arrives at its ports at known instants, and what it hands out."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from random import Random
from typing import Any

from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from fmus.plant import Plant
from netem.node.named import Named
from netem.node.node import Node
from netem.wire.messages import Grant, Report
from tests.firmware_sim.clock_faults import ClockSteps

Arrival = tuple[int, int, bytes]            # (true_ns, port, data)


class BoardBench:
    """Port 0 is `radio`, port 1 is `can`. Build the program on `board`, then go on with `until`."""

    def __init__(self, clock_steps: Sequence[tuple[int, int]] = (), ports: Sequence[str] = ("radio", "can"),
                 parameters: Mapping[str, Any] | None = None, sample_period_ns: int = 0, **clock: Any) -> None:
        self.node = Node("robot", ports, sample_period_ns)
        self.clock = LocalClock(ClockSettings(**clock), self.node.present_ns)
        self._parameters = Named(parameters or {}, "robot", "parameter", "agents.robot.parameters is empty")
        self._steps = ClockSteps(clock_steps)

    def board(self, plant: Plant | None = None) -> Board:
        board = Board(self.node, self.clock, plant, {}, Random("7/robot"), self._parameters)
        board.keep_promises()
        board.take_faults()
        return board

    def until(self, end_ns: int, *arrivals: Arrival) -> Report:
        """Go on to `end_ns`; the first time the host has greeted the node before, as in a run."""
        if not self.node.now_ns:
            self.node.hello()
        return self.node.advance(Grant(1, end_ns, False, True, list(arrivals), self._steps.before(end_ns)))

    def run(self, program: Generator[Any, Any, None], end_ns: int = 10**12) -> Report:
        """A program that is one generator, to its end."""
        self.node.start(program)
        return self.until(end_ns)
