"""A thread that waits hands over to a thread of its program that is due at this instant, without the node's thread."""

from __future__ import annotations

import signal
import threading
import time

import pytest

from firmware_sim.blocking import program as programs
from firmware_sim.blocking import resuming
from netem.node import environment
from netem.wire.messages import Grant

EVER_NS = 10**18


def run(program):
    program.node.advance(Grant(1, EVER_NS, False, False, []))


def in_a_row(turns, woken):
    """`turns` threads wake one another in a row at an instant of 1 s; each notes its number in `woken`."""
    def main():
        events = [threading.Event() for _ in range(turns)]

        def relay(number):
            events[number].wait()
            woken.append((number, time.monotonic_ns()))
            if number + 1 < turns:
                events[number + 1].set()

        threads = [threading.Thread(target=relay, args=(number,)) for number in range(turns)]
        for thread in threads:
            thread.start()
        time.sleep(1)
        events[0].set()
        for thread in threads:
            thread.join()
    return main


def counted(monkeypatch):
    """Return a list of one number: how often the node's thread has resumed a thread."""
    resumed, really = [0], programs.resume

    def resume(thread):
        resumed[0] += 1
        really(thread)

    monkeypatch.setattr(programs, "resume", resume)
    return resumed


@pytest.mark.parametrize("turns", [1, 2, 5, 20])
def test_threads_that_wake_one_another_run_in_this_order_at_the_same_instant(begin, turns):
    woken = []

    run(begin(in_a_row(turns, woken)))

    assert woken == [(number, woken[0][1]) for number in range(turns)]


def test_the_node_resumes_fewer_threads_than_run(begin, monkeypatch):
    program, resumed = begin(in_a_row(20, [])), counted(monkeypatch)

    run(program)

    assert resumed[0] == 2 + 20         # at 0 and at 1 s, and after each end of a thread, which hands over to none


def test_threads_that_wake_one_another_for_ever_at_one_instant_are_refused(begin, monkeypatch):
    monkeypatch.setattr(environment, "MAX_EVENTS_AT_ONE_INSTANT", 2_000)        # 100 000 in compiled code

    def main():
        ping, pong = threading.Semaphore(0), threading.Semaphore(1)

        def answer():
            while True:
                ping.acquire()
                pong.release()

        threading.Thread(target=answer, daemon=True).start()
        while True:
            pong.acquire()
            ping.release()

    with pytest.raises(RuntimeError, match="waits for no time to pass"):
        run(begin(main))


def test_an_exception_after_a_handover_ends_the_node(begin):
    def main():
        def fails():
            raise ZeroDivisionError("in the second thread")

        threading.Thread(target=fails).start()
        time.sleep(1)

    with pytest.raises(ZeroDivisionError, match="in the second thread"):
        run(begin(main))


def test_the_one_that_computes_after_a_handover_is_shown_in_the_log(begin, monkeypatch, capsys):
    monkeypatch.setattr(resuming, "PATIENCE_S", 0.02)
    really = time.monotonic.__wrapped__

    def main():
        def ponders():
            end_s = really() + 0.2
            while really() < end_s:
                sum(range(1000))

        thread = threading.Thread(target=ponders, name="the second")
        thread.start()
        thread.join()

    run(begin(main))

    said = capsys.readouterr().err
    assert "robot: the second has been computing for 0.02 s" in said
    assert "in ponders" in said


def test_threads_that_each_compute_for_a_short_time_are_not_shown(begin, monkeypatch, capsys):
    monkeypatch.setattr(resuming, "PATIENCE_S", 0.2)
    really = time.monotonic.__wrapped__

    def ponders():
        end_s = really() + 0.005
        while really() < end_s:
            pass

    def main():
        ping, pong = threading.Semaphore(0), threading.Semaphore(0)

        def answer():
            for _ in range(50):
                ping.acquire()
                ponders()
                pong.release()

        threading.Thread(target=answer).start()
        for _ in range(50):
            ponders()
            ping.release()
            pong.acquire()

    program = begin(main)
    began_s = really()
    run(program)

    assert really() - began_s > 2 * 0.2                 # together they took more than the patience
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("ends_by_itself", [False, True])
def test_a_run_broken_off_while_the_second_computes_ends_all_threads(begin, ends_by_itself):
    ended, really = [], time.monotonic.__wrapped__

    def main():
        def computes():
            try:
                end_s = really() + (0.3 if ends_by_itself else 60)
                while really() < end_s:
                    pass
            finally:
                ended.append("second")

        try:
            threading.Thread(target=computes).start()       # waits until the thread runs, and hands over to it
        finally:
            ended.append("main")

    def broken_off(number, frame):
        raise InterruptedError

    program = begin(main)
    before = signal.signal(signal.SIGALRM, broken_off)
    signal.setitimer(signal.ITIMER_REAL, 0.1)
    try:
        with pytest.raises(InterruptedError):
            run(program)
    finally:
        signal.signal(signal.SIGALRM, before)
    if ends_by_itself:
        until_s = really() + 20
        while "second" not in ended and really() < until_s:
            time.sleep(0.01)
    began_s = really()
    program.abandon()
    took_s = really() - began_s

    assert sorted(ended) == ["main", "second"]
    assert took_s < resuming.PATIENCE_S       # neither waited for what the other had released
