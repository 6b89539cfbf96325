"""A robot with waves on a board of the test's: its slots, and the frames that it does not use."""

from __future__ import annotations

import pytest

from agents.waves.robot import WaveRobot
from agents.waves.team import read_wave_team
from tests.agents.waves.board import Board

SLOT_NS = 20_000_000
MODEL = {"A": [[-1.0, 0.0], [1.0, 0.0]], "B": [[1.0], [0.0]], "C": [[1.0, 0.0], [0.0, 1.0]], "x0": [3.0, 0.0]}
TEAM = {"models": dict.fromkeys(("r1", "r2", "r3"), MODEL), "links": ["r1 <-> r2", "r2 <-> r3"], "slot_s": 0.02,
        "damping": 2.0}


def robot(**keys):
    board = Board()
    board.team = {**TEAM, **keys}
    WaveRobot(board)
    return board, read_wave_team(board.team).codec


def test_it_sends_in_each_of_its_slots():
    board, codec = robot(guard_s=0.001)

    board.run_until(10 * SLOT_NS)

    assert [(at_ns, codec.unpack(frame)[:2]) for at_ns, frame in board.sent] == [
        (slot * SLOT_NS + 1_000_000, (1, slot)) for slot in (1, 4, 7)]


def test_it_drives_by_the_waves_that_it_hears():
    board, codec = robot()
    board.run_until(SLOT_NS // 2)

    board.hear(codec.pack(0, 0, [1.5, 0.1]))

    assert board.input == 1.5                       # alpha = 1


@pytest.mark.parametrize(("sender", "slot"), [
    (1, 1),                                         # its own
    (0, 1), (2, 3),                                 # in the slot of another
    (0, 9), (0, 0xFFFFFFFF),                        # in a slot that has not begun
])
def test_a_frame_that_cannot_be_is_counted_and_not_used(sender, slot):
    board, codec = robot()
    board.run_until(4 * SLOT_NS)

    board.hear(codec.pack(sender, slot, [1.5, 0.1] * (2 if sender == 1 else 1)))
    board.hear(b"\xd6")

    assert board.input == 0.0
    assert board.counters["unreadable frames"] == 2


def test_with_outputs_it_holds_the_others_and_its_own_as_late():
    board, codec = robot(coupling="outputs", own_late_ns=[0, 5_000_000, 0])
    assert board.run_until(0) is None
    assert board.input == 0.0                       # every y(0) is known: 2 (3 + 3 - 2 3)

    board.hear(codec.pack(0, 0, [4.0]))
    assert board.input == 2.0
    board.integral = 7.0                            # what its sensor reads: y
    board.run_until(SLOT_NS + 4_999_999)
    assert board.input == 2.0
    board.run_until(SLOT_NS + 5_000_000)
    assert board.input == 2.0 * (4.0 + 3.0 - 2 * 7.0)
    board.hear(codec.pack(0, 0, [9.0]))
    assert board.counters["old frames"] == 1
