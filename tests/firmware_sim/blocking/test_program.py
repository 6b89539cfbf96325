"""Blocking code on a node: its time, its promises, its mistakes and its end."""

from __future__ import annotations

import signal
import sys
import threading
import time
import traceback
from contextlib import suppress
from itertools import accumulate

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from firmware_sim.blocking import resuming
from firmware_sim.blocking.here import running, this_program
from firmware_sim.blocking.inbox import Inbox
from firmware_sim.clock_settings import ClockSettings
from netem.wire.instants import NEVER_NS
from netem.wire.messages import Grant, NodeFault
from tests.examples import examples

SECOND_NS = 1_000_000_000
EVER_NS = 10**9 * SECOND_NS


def run(program, until_ns=EVER_NS, *, last=False):
    """Every event before `until_ns`; returns what the node then promises, as (soft, firm)."""
    report = program.node.advance(Grant(1, until_ns, False, last, []))
    return report.soft_ns, report.firm_ns


# --- time

def test_sleeping_advances_the_nodes_clock_and_not_the_walls(begin):
    woke = []

    def main():
        time.sleep(3600.0)
        woke.append(time.monotonic())

    before_s = time.monotonic()                 # this thread belongs to no program: the wall's
    run(begin(main))

    assert woke == [3600.0]
    assert time.monotonic() - before_s < 60


@settings(max_examples=examples(30), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.integers(0, 10**12), max_size=20))
def test_every_sleep_lasts_exactly_as_long_as_was_asked(begin, durations_ns):
    instants = []

    def main():
        for duration_ns in durations_ns:
            time.sleep(duration_ns / 1e9)
            instants.append(time.monotonic_ns())

    run(begin(main))

    assert instants == list(accumulate(durations_ns))


def test_a_loop_with_absolute_times_does_not_drift(begin):
    """Float seconds lose bits, but each wait is to the nearest nanosecond of its own instant."""
    instants = []

    def main():
        next_s = 0.0
        for _ in range(1000):
            next_s += 0.007
            time.sleep(next_s - time.monotonic())
            instants.append(time.monotonic_ns())

    run(begin(main))

    assert instants == [7_000_000 * k for k in range(1, 1001)]


def test_durations_are_the_robots_own(begin):
    def main():
        time.sleep(1.0)

    program = begin(main, drift_ppm=100.0)
    run(program)

    assert program.node.now_ns == 999_900_010        # ceil(1e9 / (1 + 1e-4)) = ceil(999_900_009.999)


def test_the_time_of_day_is_the_local_clock_and_durations_know_nothing_of_its_offset(begin):
    read = []

    def main():
        time.sleep(1.0)
        read.append((time.time(), time.time_ns(), time.monotonic(), time.perf_counter_ns()))

    run(begin(main, offset_ns=5 * SECOND_NS))

    assert read == [(6.0, 6 * SECOND_NS, 1.0, SECOND_NS)]


def test_a_step_of_the_clock_changes_the_time_of_day_and_no_wait(begin):
    read = []

    def main():
        time.sleep(1.0)
        read.append((time.time(), time.monotonic()))

    program = begin(main)
    program.node.advance(Grant(1, EVER_NS, False, False, [], [
        NodeFault(400_000_000, "clock_step", {"by_ns": -300_000_000})]))

    assert read == [(0.7, 1.0)]
    assert program.node.now_ns == SECOND_NS


def test_no_time_passes_while_the_program_computes(begin):
    read = []

    def main():
        time.sleep(0.25)
        read.append(time.monotonic_ns())
        sum(range(100_000))
        read.append(time.monotonic_ns())

    run(begin(main))

    assert read == [250_000_000, 250_000_000]


def test_the_program_starts_with_the_run_and_not_with_its_loading(begin):
    seen = []

    program = begin(lambda: seen.append(time.monotonic_ns()))
    before = list(seen)
    run(program)

    assert (before, seen) == ([], [0])


@pytest.mark.parametrize("seconds", [-1.0, float("nan"), float("inf")])
def test_a_sleep_that_is_none_is_refused(begin, seconds):
    with pytest.raises(ValueError, match=r"non-negative|finite"):
        run(begin(lambda: time.sleep(seconds)))


# --- promises

def test_who_sleeps_promises_firmly(begin):
    program = begin(lambda: time.sleep(2.0))

    assert run(program, 10) == (2 * SECOND_NS, 2 * SECOND_NS)


def test_who_waits_for_a_frame_promises_softly(begin):
    program = begin(lambda: Inbox(this_program()).take(2 * SECOND_NS))

    assert run(program, 10) == (2 * SECOND_NS, 0)


def test_of_several_threads_the_first_to_wake_is_promised_and_one_that_listens_is_enough_for_none(begin):
    def main():
        threading.Thread(target=time.sleep, args=(1.5,)).start()
        time.sleep(1.0)
        threading.Thread(target=lambda: Inbox(this_program()).take(None)).start()
        time.sleep(1.0)

    program = begin(main)

    assert run(program, 10) == (SECOND_NS, SECOND_NS)
    assert run(program, SECOND_NS + 10) == (SECOND_NS * 3 // 2, SECOND_NS)


def test_what_is_repeated_is_promised_too(begin):
    def main():
        this_program().repeat(300_000_000, None, lambda: None).start()
        time.sleep(1.0)

    program = begin(main)

    assert run(program, 310_000_000) == (600_000_000, 600_000_000)


def test_a_program_that_returns_is_silent_for_ever(begin):
    def main():
        this_program().repeat(300_000_000, None, lambda: None).start()
        threading.Thread(target=time.sleep, args=(100.0,), daemon=True).start()
        time.sleep(1.0)

    program = begin(main)

    assert run(program, SECOND_NS + 10)[1] == NEVER_NS
    assert program.over


@pytest.mark.parametrize("waits_for", ["an event", "the last thread"])
def test_a_daemon_woken_at_the_instant_at_which_the_program_ends_does_not_run_any_more(begin, waits_for):
    ran = []

    def main():
        event = threading.Event()

        def last():
            time.sleep(1.0)
            event.set()

        def late(wait):
            wait()
            ran.append(time.monotonic())
            this_program().send("radio", b"late")

        thread = threading.Thread(target=last)
        thread.start()
        threading.Thread(target=late, args=(event.wait if waits_for == "an event" else thread.join,),
                         daemon=True).start()

    program = begin(main)

    assert run(program) == (NEVER_NS, NEVER_NS)
    assert ran == []
    assert not program.node.advance(Grant(2, EVER_NS + 1, False, False, [])).offers


def test_a_thread_that_is_no_daemon_goes_on_after_the_function_returned(begin):
    woke = []

    def later():
        time.sleep(2.0)
        woke.append(time.monotonic())

    program = begin(lambda: threading.Thread(target=later).start())

    run(program, 10)
    ended_early = program.over
    run(program)

    assert (ended_early, woke, program.over) == (False, [2.0], True)


def test_who_takes_from_one_inbox_gets_an_item_each(begin):
    """Both items come before either taker has run: the first taker passes the word on."""
    taken = []

    def main():
        inbox = Inbox(this_program())
        takers = [threading.Thread(target=lambda: taken.append((inbox.take(SECOND_NS), time.monotonic())))
                  for _ in range(3)]
        for taker in takers:
            taker.start()
        time.sleep(0.5)
        inbox.put("first")
        inbox.put("second")

    run(begin(main))

    assert taken == [("first", 0.5), ("second", 0.5), (None, 1.0)]


# --- mistakes

class Odd(Exception):
    def __init__(self, first, second):
        super().__init__(f"{first} and {second}")


def test_what_the_program_raises_ends_the_node_with_its_own_traceback(begin):
    def main():
        time.sleep(0.5)
        raise Odd("this", "that")

    program = begin(main)

    with pytest.raises(Odd, match="this and that") as caught:
        run(program)

    assert any(frame.name == "main" and frame.filename == __file__ for frame in traceback.extract_tb(caught.tb))
    assert program.node.now_ns == 500_000_000


def test_what_a_thread_of_it_raises_ends_the_node_too(begin):
    def fail():
        time.sleep(0.5)
        raise Odd("this", "that")

    def main():
        threading.Thread(target=fail).start()
        time.sleep(10.0)

    program = begin(main)

    with pytest.raises(Odd):
        run(program)

    assert program.node.now_ns == 500_000_000


@pytest.mark.parametrize("code", [None, 0])
def test_a_good_exit_is_a_return(begin, code):
    program = begin(lambda: sys.exit(code))

    run(program)

    assert program.over


def test_a_bad_exit_ends_the_node(begin):
    with pytest.raises(SystemExit, match="I give up"):
        run(begin(lambda: sys.exit("I give up")))


def test_what_loading_raises_is_raised_before_the_run(begin):
    from firmware_sim.blocking.program import BlockingProgram

    def load():
        raise ModuleNotFoundError("no such module")

    other = begin(lambda: None)
    program = BlockingProgram(other.node, other.board, ClockSettings(), load)

    with pytest.raises(ModuleNotFoundError, match="no such module"):
        program.begin()


def test_who_computes_for_long_is_shown_in_the_log(begin, monkeypatch, capsys):
    monkeypatch.setattr(resuming, "PATIENCE_S", 0.02)
    really = time.monotonic.__wrapped__

    def ponders():
        end_s = really() + 0.2
        while really() < end_s:
            sum(range(1000))

    run(begin(ponders))

    said = capsys.readouterr().err
    assert "robot: the program has been computing for 0.02 s without waiting for anything" in said
    assert "in ponders" in said


def test_outside_of_a_program_there_is_none():
    assert running() is None
    with pytest.raises(RuntimeError, match="inside `marconet run`"):
        this_program()


# --- the end of the run

def test_the_end_of_the_run_is_a_ctrl_c_and_what_is_sent_then_goes_nowhere(begin):
    ended = []

    def main():
        try:
            while True:
                time.sleep(10.0)
        except KeyboardInterrupt:
            ended.append("interrupted")
        finally:
            this_program().send("can0", b"parting words")
            time.sleep(0.5)
            ended.append(time.monotonic())

    program = begin(main)
    run(program, SECOND_NS, last=True)

    assert ended == ["interrupted", 1.5]
    assert program.node._offers == []
    assert program.over


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_handler_of_the_program_is_called_instead(begin, number):
    stop = []

    def main():
        assert callable(signal.signal(number, lambda *_: stop.append(time.monotonic()))) or number == signal.SIGTERM
        while not stop:
            time.sleep(0.3)

    before = signal.getsignal(number)
    program = begin(main)
    run(program, SECOND_NS, last=True)

    assert stop == [1.0]
    assert program.over
    assert signal.getsignal(number) is before


def test_a_thread_that_waits_at_the_end_unwinds(begin):
    left = []

    def waits():
        try:
            Inbox(this_program()).take(None)
        finally:
            try:
                time.sleep(100.0)
            finally:
                left.append("waits")

    def main():
        threading.Thread(target=waits, daemon=True).start()
        Inbox(this_program()).take(None)

    program = begin(main)
    run(program, SECOND_NS, last=True)

    assert left == ["waits"]
    assert [thread.name for thread in threading.enumerate() if "waits" in thread.name] == []


def test_a_thread_that_will_not_end_is_given_up_and_named(begin, capsys):
    stays = True

    def main():
        while stays:
            with suppress(BaseException):
                time.sleep(1.0)

    program = begin(main)
    run(program, SECOND_NS, last=True)

    assert "robot: the program did not end with the run" in capsys.readouterr().err
    stays = False
    program._main.go.give()        # let the thread go, for the sake of the next test
