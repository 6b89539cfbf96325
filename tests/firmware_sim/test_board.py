from random import Random

import pytest

from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from netem.node.node import Node, PromiseBroken


def a_board(clock_steps=(), **settings) -> Board:
    node = Node("robot", ["radio"])
    clock = LocalClock(ClockSettings(**settings), lambda: node.now_ns)
    return Board(node, clock, None, {}, Random("7/robot"), clock_steps)


def test_waiting_ends_at_the_first_instant_that_reads_the_local_time():
    board = a_board(offset_ns=500, drift_ppm=-100.0, tick_ns=1000)
    woke = []

    def program():
        yield board.until(1_000_000)
        woke.append((board.node.now_ns, board.now_ns))

    board.node.start(program())
    board.node.env.run()

    assert woke == [(board.clock.true_at(1_000_000), 1_000_000)]
    assert woke[0][0] == 999_600                # ceil((1_000_000 - 500) / (1 - 1e-4)) = ceil(999_599.96)


def test_waiting_for_a_local_time_that_is_past_ends_at_once():
    board = a_board(offset_ns=10**6)
    woke = []

    def program():
        yield board.until(5)
        woke.append(board.node.now_ns)
        yield from board.sleep_until(5)
        woke.append(board.node.now_ns)

    board.node.start(program())
    board.node.env.run()

    assert woke == [0, 0]


def test_a_clock_that_is_set_back_under_way_wakes_the_armed_timer_early_and_wait_until_waits_on():
    board = a_board(clock_steps=[(400, -300)])
    woke = {}

    def armed_once():
        yield board.until(1000)
        woke["until"] = (board.node.now_ns, board.now_ns)

    def waits_on():
        yield from board.sleep_until(1000)
        woke["wait_until"] = (board.node.now_ns, board.now_ns)

    board.node.start(armed_once())
    board.node.start(waits_on())
    board.node.env.run()

    assert woke == {"until": (1000, 700), "wait_until": (1300, 1000)}


def test_a_clock_that_is_set_forward_under_way_wakes_late_by_the_step():
    board = a_board(clock_steps=[(400, 300)])
    woke = []

    def program():
        yield from board.sleep_until(1000)
        woke.append((board.node.now_ns, board.now_ns))

    board.node.start(program())
    board.node.env.run()

    assert woke == [(1000, 1300)]


def test_a_promise_is_kept_on_the_local_clock():
    board = a_board(drift_ppm=100_000.0)

    def program():
        board.silent_until(1_100_000)
        yield board.until(1_099_998)        # true 999_999
        with pytest.raises(PromiseBroken):
            board.port("radio").send(b"early")
        yield board.until(1_100_000)
        board.port("radio").send(b"in time")

    board.node.start(program())
    board.node.env.run()

    assert board.node.now_ns == 1_000_000


def test_no_promise_reaches_beyond_the_next_step_of_the_clock():
    """A step forward may bring the next slot nearer; a promise across it would then be broken innocently."""
    board = a_board(clock_steps=[(400, 5_000), (800, -5_000)])
    sent = []

    def program():
        board.silent_until(6_000)
        yield board.until(500)                      # armed before the step: true time 500
        board.port("radio").send(b"due now: local time is 5500")
        sent.append(board.node.now_ns)
        board.silent_until(6_000)                   # true 1000, cut to 800
        yield board.until(5_850)                    # armed at true 500, for true 850
        board.port("radio").send(b"the clock went back meanwhile")
        sent.append(board.node.now_ns)

    board.node.start(program())
    board.node.env.run()

    assert sent == [500, 850]


def test_clock_steps_have_to_be_in_order():
    with pytest.raises(ValueError, match=r"robot: clock_steps at \[5, 3\] ns"):
        a_board(clock_steps=[(5, 1), (3, 1)])
