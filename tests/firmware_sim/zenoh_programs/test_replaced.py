"""What is replaced in the library's modules, for whom and for how long."""

from __future__ import annotations

import time
from random import Random

import zenoh

from firmware_sim.blocking.library_time import library_in_virtual_time
from firmware_sim.blocking.node import BlockingNode
from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from firmware_sim.zenoh_programs import channels, entities, session
from firmware_sim.zenoh_programs.replaced import CHANNELS, CLASSES, zenoh_in_virtual_time
from firmware_sim.zenoh_programs.specification import ZenohMedium, ZenohSpecification
from netem.wire.messages import Grant

SPECIFICATION = ZenohSpecification(("robot", "other"), (ZenohMedium("radio", 60, False),), (("**", "radio"),))


def names() -> list[object]:
    return [zenoh.open, zenoh.scout, *(getattr(zenoh, each.__name__) for each in CLASSES),
            *(getattr(zenoh.handlers, each.__name__) for each in CHANNELS), zenoh.ext.declare_advanced_publisher]


def test_only_the_programs_threads_get_the_replacements_and_the_library_is_back_at_the_end() -> None:
    seen: list[object] = []

    def main() -> None:
        with zenoh_in_virtual_time(SPECIFICATION), zenoh.open(zenoh.Config()) as opened:
            seen.append((type(opened), type(zenoh.handlers.FifoChannel(3)), isinstance(opened, zenoh.Session)))
            seen.append(type(opened.declare_subscriber("a")))
            time.sleep(10)

    before = names()
    node = BlockingNode("robot", ["radio"])
    board = Board(node, LocalClock(ClockSettings(), node.env.time_ns), None, {}, Random("7/robot"), {})
    board.take_faults()
    with library_in_virtual_time():
        node.program = BlockingProgram(node, board, ClockSettings(), lambda: main)
        try:
            node.program.begin()
            node.hello()
            report = node.advance(Grant(0, 5_000_000_000, False, False, []))
            real = zenoh.handlers.FifoChannel(3), zenoh.handlers.Callback(print)
            assert isinstance(real[0], zenoh.handlers.FifoChannel)
            between = names()
        finally:
            node.program.finish()

    assert seen == [(session.Session, channels.FifoChannel, True), entities.Subscriber]
    assert [type(one).__module__ for one in real] == ["builtins", "builtins"]
    assert between != before
    assert names() == before
    assert len(report.offers) >= 3 + 3          # requests for declarations, and the subscriber told three times


def test_a_second_program_keeps_the_replacements_when_the_first_has_ended() -> None:
    before = names()

    first, second = (_program(seconds) for seconds in (1, 3))
    with library_in_virtual_time():
        for node in (first, second):
            assert node.program is not None
            node.program.begin()
            node.hello()
        for node in (first, second):
            node.advance(Grant(0, 2_000_000_000, False, False, []))
        assert names() != before
        second.advance(Grant(1, 4_000_000_000, False, False, []))

    assert names() == before


def _program(seconds: float) -> BlockingNode:
    node = BlockingNode("robot", ["radio"])
    board = Board(node, LocalClock(ClockSettings(), node.env.time_ns), None, {}, Random("7/robot"), {})
    board.take_faults()

    def main() -> None:
        with zenoh_in_virtual_time(SPECIFICATION):
            time.sleep(seconds)

    node.program = BlockingProgram(node, board, ClockSettings(), lambda: main)
    return node
