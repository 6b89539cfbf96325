"""Computing takes the instructions since the wake-up times their cost, and interrupts come at exact instructions."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from firmware_sim.cortex_m.image import read_image
from firmware_sim.cortex_m.machine import Ask, Machine
from tests.firmware_sim.cortex_m.boards import board_node, offers

PERIOD_NS, OFFSET_NS, ROUNDS = 5_000_000, 1_000_000, 5_000
VALUES = [[PERIOD_NS], [OFFSET_NS], [ROUNDS]]
NS_PER_INSTRUCTION = 10         # of 100 MHz
ONE_FRAME_NS = OFFSET_NS + PERIOD_NS


def send_counts(image: Path, arrival: tuple[int, bytes] | None = None) -> int:
    """Return the instructions from the timer's interrupt to the frame; a frame arrives after so many of them."""
    machine = Machine(read_image(image), 100_000_000, 1.0, [1], VALUES, [0, 0, 0, 0])
    machine.reset(0)
    machine.run()
    list(machine.commands())
    machine.run()
    machine.at(OFFSET_NS, OFFSET_NS)
    begin = machine.count
    machine.ring(3)
    if arrival is not None:
        machine.run(OFFSET_NS + arrival[0] * NS_PER_INSTRUCTION)
        assert machine.count == begin + arrival[0]
        machine.receive(0, arrival[1])
    machine.run()                                   # to the first command
    sent = machine.count
    assert [ask for ask, *_ in machine.commands()] == [Ask.SEND]
    machine.close()
    return sent - begin


def test_without_a_cost_computing_takes_no_time(image: Callable[..., Path]):
    sent = offers(board_node(image("beacon"), values=VALUES), ONE_FRAME_NS)

    assert sent == [(OFFSET_NS, 0, bytes(8))]


def test_a_frame_is_sent_when_the_instructions_before_it_are_executed(image: Callable[..., Path]):
    instructions = send_counts(image("beacon"))

    (sent,) = offers(board_node(image("beacon"), values=VALUES, cycles_per_instruction=1.0), ONE_FRAME_NS)
    (slower,) = offers(board_node(image("beacon"), values=VALUES, cycles_per_instruction=1.5), ONE_FRAME_NS)

    assert instructions > ROUNDS
    assert sent[0] == OFFSET_NS + instructions * NS_PER_INSTRUCTION
    assert slower[0] == OFFSET_NS + instructions * NS_PER_INSTRUCTION * 3 // 2


def test_an_interrupt_preempts_at_the_instruction_of_its_instant(image: Callable[..., Path]):
    alone, frame, random = send_counts(image("beacon")), bytes([41, 0, 0, 0]), Random(5)

    for after in [0, 1, alone - 1, *(random.randrange(alone) for _ in range(10))]:
        node = board_node(image("beacon"), values=VALUES, cycles_per_instruction=1.0)
        arrives_ns = OFFSET_NS + after * NS_PER_INSTRUCTION - (0 if after == 0 else random.randrange(10))
        (sent,) = offers(node, ONE_FRAME_NS, [(arrives_ns, 0, frame)])
        expected = send_counts(image("beacon"), (after, frame))

        assert sent[0] == OFFSET_NS + expected * NS_PER_INSTRUCTION, after
        assert after == 0 or expected > alone


@pytest.mark.parametrize("cost", [0.0, 1.0])
def test_the_node_promises_silence_until_the_frame(image: Callable[..., Path], cost: float):
    from netem.wire.messages import Grant

    node = board_node(image("beacon"), values=VALUES, cycles_per_instruction=cost)
    report = node.advance(Grant(1, OFFSET_NS - 1, False, False, []))

    assert report.soft_ns == OFFSET_NS
