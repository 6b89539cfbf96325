"""Runs functions of tests as blocking programs with sockets, on one node of this process in virtual time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from random import Random

import pytest

from firmware_sim.blocking.library_time import library_in_virtual_time
from firmware_sim.blocking.node import BlockingNode
from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from firmware_sim.sockets.interface import Interface
from firmware_sim.sockets.library_sockets import sockets_in_virtual_time
from netem.wire.messages import Grant, Report

LAN = Interface("lan", "10.0.0.0/16", {"robot": "10.0.0.1", "other": "10.0.0.2"})
BARE = Interface("uart")
Begin = Callable[..., BlockingProgram]


def a_program(function: Callable[..., object], *interfaces: Interface) -> BlockingProgram:
    node = BlockingNode("robot", [one.medium for one in interfaces] or ["radio"])
    board = Board(node, LocalClock(ClockSettings(), node.env.time_ns), None, {}, Random("7/robot"), {})
    board.take_faults()
    node.program = BlockingProgram(node, board, ClockSettings(), lambda: function, interfaces=interfaces)
    node.program.begin()
    return node.program


def run(program: BlockingProgram, until_ns: int = 10**11, deliveries: list[tuple[int, int, bytes]] | None = None,
        last: bool = False) -> Report:
    return program.node.advance(Grant(0, until_ns, False, last, deliveries or []))


@pytest.fixture
def begin() -> Iterator[Begin]:
    """begin(function, LAN) returns the program, loaded and waiting for its node to run."""
    begun: list[BlockingProgram] = []

    def program(function: Callable[..., object], *interfaces: Interface) -> BlockingProgram:
        begun.append(a_program(function, *interfaces))
        return begun[-1]

    with library_in_virtual_time(), sockets_in_virtual_time():
        try:
            yield program
        finally:
            for one in begun:
                one.finish()
