"""Timers of a board: at, every and their cancel, on a clock that drifts, ticks and is set."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netem.wire.instants import NEVER_NS
from tests.firmware_sim.board_bench import BoardBench


def listener(bench: BoardBench):
    """A board that only listens, so that its promises are firm, and how it notes (true, local) instants."""
    board, noted = bench.board(), []
    for name in board.ports:
        board.port(name, listen_only=True)
    return board, noted, lambda: noted.append((bench.node.now_ns, board.now_ns))


def test_an_action_comes_once_at_the_first_instant_that_reads_its_time():
    bench = BoardBench(offset_ns=500, drift_ppm=-100.0, tick_ns=1000)
    board, noted, note = listener(bench)

    board.at(1_000_000, note)

    assert bench.until(10).firm_ns == 999_600
    assert bench.until(10**7).firm_ns == NEVER_NS
    assert noted == [(999_600, 1_000_000)]


def test_an_action_whose_time_has_passed_comes_at_once():
    bench = BoardBench(offset_ns=1000)
    board, noted, note = listener(bench)

    board.at(5, note)
    assert noted == []                      # not within the call
    bench.until(100)

    assert noted == [(0, 1000)]


def test_an_action_waits_on_if_the_clock_was_set_back_and_the_promise_with_it():
    bench = BoardBench(clock_steps=[(400, -300)])
    board, noted, note = listener(bench)

    board.at(1000, note)

    assert [bench.until(end_ns).firm_ns for end_ns in (100, 450, 1100)] == [1000, 1000, 1300]
    bench.until(2000)
    assert noted == [(1300, 1000)]


def test_an_action_comes_late_if_the_clock_was_set_forward():
    bench = BoardBench(clock_steps=[(400, 300)])
    board, noted, note = listener(bench)

    board.at(1000, note)
    bench.until(2000)

    assert noted == [(1000, 1300)]


@pytest.mark.parametrize("sends", [True, False])
def test_a_cancelled_action_never_comes_and_its_promise_is_free(sends):
    bench = BoardBench()
    board, noted, note = listener(bench)

    timer = board.at(500, note, sends=sends)
    board.at(900, note)
    board.at(200, timer.cancel, sends=False)

    assert [bench.until(end_ns).firm_ns for end_ns in (100, 300)] == [500 if sends else 900, 900]
    bench.until(1000)
    assert noted == [(900, 900)]
    timer.cancel()                          # once more, and after its time
    assert bench.until(1100).firm_ns == NEVER_NS


def test_an_action_that_came_cannot_be_cancelled():
    bench = BoardBench()
    board, noted, note = listener(bench)

    timer = board.at(500, note)
    board.at(500, note)
    bench.until(600)
    timer.cancel()

    assert noted == [(500, 500)] * 2
    assert bench.until(700).firm_ns == NEVER_NS


@given(period_ns=st.integers(1, 5000), offset_ns=st.integers(0, 20_000), start_ns=st.integers(0, 20_000),
       drift_ppm=st.sampled_from([-1e5, -50.0, 0.0, 50.0, 1e5]), tick_ns=st.sampled_from([1, 7, 1000]))
def test_a_repetition_comes_at_offset_plus_k_periods_of_the_local_clock(period_ns, offset_ns, start_ns, drift_ppm,
                                                                        tick_ns):
    bench = BoardBench(offset_ns=start_ns, drift_ppm=drift_ppm, tick_ns=tick_ns)
    board, noted, note = listener(bench)
    first_ns = board.now_ns

    board.every(period_ns, note, offset_ns=offset_ns)
    bench.until(50_000)

    due_ns = [offset_ns + k * period_ns for k in range(80_000 // period_ns + 2)]
    instants = [max(0, bench.clock.true_at(local_ns)) for local_ns in due_ns if local_ns >= first_ns]
    assert [true_ns for true_ns, _ in noted] == [true_ns for true_ns in instants if true_ns < 50_000]


def test_a_clock_that_is_set_brings_no_instant_twice_and_forgets_none():
    bench = BoardBench(clock_steps=[(450, -300), (800, 250)])
    board, noted, note = listener(bench)

    board.every(100, note)
    bench.until(1101)

    # k = 5 waits on as the clock was set back; from 700 on, local time is true time less 300; 250 more from 800 on
    assert noted == [(0, 0), (100, 100), (200, 200), (300, 300), (400, 400), (800, 750), (800, 750), (800, 750),
                     (850, 800), (950, 900), (1050, 1000)]


def test_a_repetition_ends_when_it_is_cancelled_also_by_its_own_action():
    bench = BoardBench()
    board, noted, note = listener(bench)

    def act():
        note()
        if len(noted) == 3:
            repetition.cancel()

    repetition = board.every(100, act, offset_ns=50)

    assert bench.until(60).firm_ns == 150
    assert bench.until(1000).firm_ns == NEVER_NS
    assert [local_ns for _, local_ns in noted] == [50, 150, 250]


@pytest.mark.parametrize(("given", "says"), [
    ({"period_ns": 0}, "period_ns=0: expected at least 1"),
    ({"period_ns": 5, "offset_ns": -1}, "offset_ns=-1: expected 0 or more")])
def test_a_repetition_without_a_period_is_refused(given, says):
    with pytest.raises(ValueError, match=says):
        BoardBench().board().every(action=print, **given)
