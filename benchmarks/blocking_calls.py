"""What a call of a blocking program costs: one that waits (a hand-over between threads and back), one that does not.

    python -m benchmarks.blocking_calls                 # as the scheduler has it
    taskset -c 0 python -m benchmarks.blocking_calls    # both threads on one core

Median of 5 rounds, in microseconds of the wall's time, on a node of this process without a medium.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from random import Random
from statistics import median

import can

from firmware_sim.blocking.library_time import library_in_virtual_time
from firmware_sim.blocking.node import BlockingNode
from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from netem.media.can.frame import CanFrame, pack
from netem.wire.messages import Grant

CALLS = 5_000
ROUNDS = 5
wall_s = time.perf_counter


def sleep() -> None:
    for _ in range(CALLS):
        time.sleep(1e-3)


def recv_that_waits() -> None:
    with can.Bus(interface="marconet") as bus:
        for _ in range(CALLS):
            bus.recv(0.5)


def recv_of_what_is_there() -> None:
    with can.Bus(interface="marconet") as bus:
        time.sleep(1e-3 * (CALLS + 1))
        for _ in range(CALLS):
            bus.recv(0.5)


def send() -> None:
    message = can.Message(arbitration_id=1, data=bytes(8), is_extended_id=False)
    with can.Bus(interface="marconet") as bus:
        for _ in range(CALLS):
            bus.send(message)


def us_per_call(function: Callable[[], None], frames: int) -> float:
    """`frames` arrive at 1, 2, 3 ... ms."""
    node = BlockingNode("robot", ["can0"])
    board = Board(node, LocalClock(ClockSettings(), node.env.time_ns), None, {}, Random(1), {})
    node.program = BlockingProgram(node, board, ClockSettings(), lambda: function, {}, {"can0": "can"})
    node.program.begin()
    data = pack(CanFrame(1, bytes(8)))
    grant = Grant(1, 10**12, False, True, [(k * 1_000_000, 0, data) for k in range(1, frames + 1)])
    start_s = wall_s()
    node.advance(grant)
    return (wall_s() - start_s) / CALLS * 1e6


if __name__ == "__main__":
    with library_in_virtual_time():
        for one, frames in ((sleep, 0), (recv_that_waits, CALLS), (recv_of_what_is_there, CALLS), (send, 0)):
            cost_us = median(us_per_call(one, frames) for _ in range(ROUNDS))
            print(f"{one.__name__.replace('_', ' '):24} {cost_us:6.1f} us")
