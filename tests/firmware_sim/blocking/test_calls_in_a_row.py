"""Computing takes time: loops that wait for no time to pass, and programs that must not notice."""

from __future__ import annotations

import queue
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_sim.blocking.calls_in_a_row import (
    FIRST_ROW,
    LATER_ROW,
    LONGEST_NS,
    RESOLUTION,
    SHORTEST_NS,
    CallsInARow,
)
from netem.wire.messages import Grant

MS = 1_000_000
EVER_NS = 10**18


def run(program, until_ns=EVER_NS):
    program.node.advance(Grant(1, until_ns, False, False, []))


# --- the cost of a call

def test_the_first_calls_of_a_row_cost_nothing_and_each_after_them_costs_some():
    row = CallsInARow()

    costs = [row.next_cost_ns() for _ in range(FIRST_ROW + 2)]

    assert costs == [0] * (FIRST_ROW - 1) + [SHORTEST_NS] * 3


def test_who_has_spun_once_is_expected_to_spin_again():
    row = CallsInARow()
    for _ in range(FIRST_ROW):
        row.next_cost_ns()

    row.end()

    assert [row.next_cost_ns() for _ in range(LATER_ROW)] == [0] * (LATER_ROW - 1) + [SHORTEST_NS]


@given(st.integers(1, 10**9))
def test_a_busy_wait_ends_at_most_a_thousandth_of_its_length_late(length_ns):
    row, spent_ns = CallsInARow(), 0

    while spent_ns < length_ns:
        spent_ns += row.next_cost_ns()

    assert spent_ns - length_ns < min(LONGEST_NS, max(SHORTEST_NS, length_ns / RESOLUTION))


# --- loops that spin

def test_a_loop_that_asks_for_more_than_has_passed_ends(begin):
    """It sleeps for exactly what is left: on no machine is the clock then where it asked for, but later."""
    ended = []

    def main():
        start_ns = time.perf_counter_ns()
        while not time.perf_counter_ns() - start_ns > 5 * MS:
            if (left_ns := 5 * MS - (time.perf_counter_ns() - start_ns)) > 0:
                time.sleep(left_ns / 1e9)
        ended.append(time.perf_counter_ns())

    run(begin(main))

    assert 5 * MS < ended[0] <= 5 * MS + 4 * SHORTEST_NS        # at most four readings in a turn of the loop


@pytest.mark.parametrize("read_s", [
    "time.time()", "time.time_ns() / 1e9", "time.monotonic()", "time.monotonic_ns() / 1e9", "time.perf_counter()",
    "time.perf_counter_ns() / 1e9", "time.clock_gettime(time.CLOCK_MONOTONIC)",
    "time.clock_gettime_ns(time.CLOCK_REALTIME) / 1e9"])
def test_a_busy_wait_on_any_clock_lasts_as_long_as_it_asked_for(begin, read_s):
    ended_ns = []

    def main():
        while eval(read_s) < 0.01:
            pass
        ended_ns.append(time.monotonic_ns())

    run(begin(main))

    assert 0 <= ended_ns[0] - 10 * MS <= 2 * 10 * MS // RESOLUTION


@pytest.mark.parametrize("duration_s", [0, 1e-9, 1e-7])
def test_sleeping_for_next_to_nothing_lets_time_pass(begin, duration_s):
    ended_ns = []

    def main():
        while time.monotonic() < 0.002:
            time.sleep(duration_s)
        ended_ns.append(time.monotonic_ns())

    run(begin(main))

    assert 2 * MS <= ended_ns[0] <= 2 * MS + 3 * 2 * MS // RESOLUTION        # a sleep and a reading in a turn


def until_empty(wait, stop):
    while wait.empty():
        pass
    assert wait.get_nowait() == 1
    with pytest.raises(queue.Empty):
        wait.get_nowait()


def until_given(wait, stop):
    while True:
        with suppress(queue.Empty):
            return wait.get_nowait()


def until_taken(wait, stop):
    tokens = threading.Semaphore(0)
    threading.Timer(0.02, tokens.release).start()
    while not tokens.acquire(blocking=False):
        pass


def until_set(wait, stop):
    while not stop.is_set():
        pass


def until_ended(wait, stop):
    sleeper = threading.Thread(target=time.sleep, args=(0.02,))
    sleeper.start()
    while sleeper.is_alive():
        pass


def until_unlocked(wait, stop):
    lock = threading.Lock()
    lock.acquire()
    threading.Timer(0.02, lock.release).start()
    while not lock.acquire(blocking=False):
        pass


def until_joined(wait, stop):
    sleeper = threading.Thread(target=lambda: (time.sleep(0.02), stop.set()))
    sleeper.start()
    while "set" not in repr(stop).replace("unset", ""):         # the join alone lets time pass
        sleeper.join(0)


def until_alone(wait, stop):
    before = threading.active_count()
    threading.Timer(0.02, stop.set).start()
    while threading.active_count() > before:
        pass


def until_listed_no_more(wait, stop):
    sleeper = threading.Timer(0.02, stop.set)
    sleeper.start()
    while sleeper in threading.enumerate():
        pass


def until_not_running(wait, stop):
    with ThreadPoolExecutor() as pool:
        future = pool.submit(time.sleep, 0.02)
        time.sleep(0)
        while future.running():
            pass


@pytest.mark.parametrize("polls", [
    until_empty, until_given, until_taken, until_set, until_ended, until_unlocked, until_joined, until_alone,
    until_listed_no_more, until_not_running])
def test_a_loop_that_polls_another_thread_goes_on_soon_after_that_has_acted(begin, polls):
    ended_ns = []

    def main():
        wait, stop = queue.Queue(), threading.Event()
        threading.Timer(0.02, lambda: (wait.put(1), stop.set())).start()
        polls(wait, stop)
        ended_ns.append(time.monotonic_ns())

    run(begin(main))

    # late by the poll under way, the one that finds it, and the reading; each costs a thousandth of the row
    assert 20 * MS <= ended_ns[0] <= 20 * MS + 3 * 21 * MS // RESOLUTION


def test_a_busy_wait_is_measured_on_the_nodes_own_oscillator(begin):
    """A tick of 1 ms: the clock shows nothing between, so the wait ends with the tick."""
    ended = []

    def main():
        while (now_s := time.monotonic()) < 0.02:
            pass
        ended.append(now_s)

    program = begin(main, tick_ns=MS, drift_ppm=-1000.0)
    run(program)

    assert ended == [0.02]
    assert program.node.now_ns == 20_020_021         # ceil(0.02 s / 0.999)


def test_two_threads_that_spin_take_turns_and_repeat_exactly(begin):
    def trace():
        noted = []

        def spin(name, until_s):
            while time.monotonic() < until_s:
                pass
            noted.append((name, time.monotonic_ns()))

        def main():
            threads = [threading.Thread(target=spin, args=(name, until_s))
                       for name, until_s in (("a", 0.004), ("b", 0.003))]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()

        run(begin(main))
        return noted

    first, second = trace(), trace()

    assert first == second
    assert [name for name, _ in first] == ["b", "a"]


# --- programs that do not spin

def test_many_readings_at_one_instant_are_one_reading(begin):
    read = []

    def main():
        for k in range(1, 4):
            time.sleep(k / 1000)
            read.append({time.monotonic_ns() for _ in range(FIRST_ROW - 2)})

    run(begin(main))

    assert read == [{1 * MS}, {3 * MS}, {6 * MS}]


def test_filling_and_emptying_a_long_queue_takes_no_time(begin):
    at_ns = []

    def main():
        jobs = queue.Queue()
        for k in range(3 * FIRST_ROW):
            jobs.put(k)
        while not jobs.empty():
            jobs.get()
        at_ns.append(time.monotonic_ns())

    run(begin(main))

    assert at_ns == [0]
