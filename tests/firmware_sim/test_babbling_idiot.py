"""A babbling idiot says the same frame at every period between two instants, and takes nothing that is no CAN frame."""

from __future__ import annotations

from random import Random

import pytest

from firmware_sim.babbling_idiot import BabblerSettings, BabblingIdiot
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from netem.media.can.frame import CanFrame, unpack
from netem.node.node import Node
from netem.wire.messages import Grant


def idiot(**parameters: int) -> Node:
    node = Node("idiot", ["can"])
    board = Board(node, LocalClock(ClockSettings(), lambda: node.now_ns), None, {}, Random(1), {})
    board.keep_promises()
    node.start(BabblingIdiot(board, BabblerSettings(**parameters)).run())
    node.hello()
    return node


def test_one_frame_each_period_within_its_time():
    report = idiot(from_ns=1_000, until_ns=1_900, period_ns=300, can_id=3, length=2).advance(
        Grant(1, 5_000, False, False, []))

    assert [time_ns for time_ns, _, _ in report.offers] == [1_000, 1_300, 1_600]
    assert {unpack(data) for _, _, data in report.offers} == {CanFrame(3, b"\x55\x55", dlc=2)}
    assert report.firm_ns >= 1_600


@pytest.mark.parametrize("parameters", [
    {"from_ns": 5, "until_ns": 5, "period_ns": 1}, {"from_ns": 0, "until_ns": 5, "period_ns": 0},
    {"from_ns": 0, "until_ns": 5, "period_ns": 1, "can_id": 0x800},
    {"from_ns": 0, "until_ns": 5, "period_ns": 1, "length": 9},
])
def test_what_no_bus_has_is_refused(parameters):
    with pytest.raises(ValueError, match="expected"):
        idiot(**parameters)
