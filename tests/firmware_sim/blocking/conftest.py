"""Runs functions of tests as blocking programs, on nodes of this process in virtual time."""

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

Begin = Callable[..., BlockingProgram]


def a_program(function: Callable[..., object], **clock: float) -> BlockingProgram:
    node = BlockingNode("robot", ["can0", "radio"])
    settings = ClockSettings(**clock)
    board = Board(node, LocalClock(settings, node.env.time_ns), None, {}, Random("7/robot"), {})
    board.take_faults()
    node.program = BlockingProgram(node, board, settings, lambda: function, {},
                                   {"can0": "can", "radio": "broadcast_radio"})
    node.program.begin()
    return node.program


@pytest.fixture
def begin() -> Iterator[Begin]:
    """begin(function, drift_ppm=...) returns the program, loaded and waiting for its node to run."""
    begun: list[BlockingProgram] = []

    def program(function: Callable[..., object], **clock: float) -> BlockingProgram:
        begun.append(a_program(function, **clock))
        return begun[-1]

    with library_in_virtual_time():
        try:
            yield program
        finally:
            for one in begun:
                one.finish()
