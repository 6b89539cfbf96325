"""Batons let one thread at a time go on, in C and in Python alike; the test builds the C if this run has none."""

from __future__ import annotations

import math
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from firmware_sim.blocking import python_batons
from tests.extensions import extension

SIGNAL_EVERY_S = 0.01
LONG_S = 20.0           # only a baton that fails its test takes so long


@pytest.fixture(scope="module")
def c_batons(tmp_path_factory: pytest.TempPathFactory) -> Any:
    return extension("firmware_sim.blocking.c_batons", tmp_path_factory.mktemp("built"))


@pytest.fixture(params=["C", "Python"])
def kind(request: pytest.FixtureRequest) -> Any:
    return request.getfixturevalue("c_batons") if request.param == "C" else python_batons


@contextmanager
def signals(handler: Any) -> Iterator[None]:
    """Call `handler` every 10 ms in the main thread."""
    before = signal.signal(signal.SIGALRM, handler)
    signal.setitimer(signal.ITIMER_REAL, SIGNAL_EVERY_S, SIGNAL_EVERY_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def of_each(kind: Any) -> list[Any]:
    return [kind.Baton, *([kind.EventBaton] if hasattr(kind, "EventBaton") else [])]


def test_a_baton_that_was_given_is_there_for_one_take(kind: Any) -> None:
    baton = kind.Baton()

    before = baton.take(0)
    baton.give()

    assert (before, baton.take(0), baton.take(0.001)) == (False, True, False)


def test_two_threads_run_by_turns(kind: Any) -> None:
    for baton in of_each(kind):
        ours, theirs, order = kind.Baton(), baton(), []

        def answer(ours: Any = ours, theirs: Any = theirs, order: list[int] = order) -> None:
            theirs.take()
            for number in range(1, 1000, 2):
                order.append(number)
                kind.pass_on(ours, theirs) if number < 999 else ours.give()

        thread = threading.Thread(target=answer)
        thread.start()
        for number in range(0, 1000, 2):
            order.append(number)
            assert kind.pass_on(theirs, ours, LONG_S)
        thread.join()

        assert order == list(range(1000))


def test_what_was_passed_on_is_given_although_nothing_comes_back(kind: Any) -> None:
    for baton in of_each(kind):
        theirs = baton()

        assert not kind.pass_on(theirs, kind.Baton(), 0.001)
        assert theirs.take()


def test_other_threads_run_while_one_waits(kind: Any) -> None:
    for baton in of_each(kind):
        theirs = baton()
        thread = threading.Thread(target=theirs.take)
        thread.start()                  # returns once that thread has begun
        time.sleep(0)
        theirs.give()
        thread.join()


def test_the_exception_of_a_signals_handler_ends_the_wait(kind: Any) -> None:
    def breaks_off(number: int, frame: object) -> None:
        raise InterruptedError("by the handler")

    theirs = kind.Baton()
    with signals(breaks_off), pytest.raises(InterruptedError, match="by the handler"):
        kind.pass_on(theirs, kind.Baton(), LONG_S)

    assert theirs.take(0)               # given once, however often the wait is interrupted
    assert not theirs.take(0)


def test_signals_neither_end_a_wait_nor_make_it_longer(kind: Any) -> None:
    seen: list[int] = []
    waits_s = 20 * SIGNAL_EVERY_S
    theirs = kind.Baton()

    def sees(number: int, frame: object) -> None:
        seen.append(number)
        if len(seen) == 1000:
            signal.setitimer(signal.ITIMER_REAL, 0)

    with signals(sees):
        began_s = time.monotonic()
        came = kind.pass_on(theirs, kind.Baton(), waits_s)
        took_s = time.monotonic() - began_s

    assert not came
    assert took_s >= waits_s
    assert 1 < len(seen) < 1000         # 1000, if each signal began the time-out anew
    assert (theirs.take(0), theirs.take(0)) == (True, False)


@pytest.mark.parametrize("timeout_s", [1e10, math.inf, math.nan])
def test_a_timeout_that_no_clock_has_is_refused(kind: Any, timeout_s: float) -> None:
    with pytest.raises((OverflowError, ValueError)):
        kind.Baton().take(timeout_s)


def test_a_number_is_no_baton_and_no_text_a_timeout(kind: Any) -> None:
    baton = kind.Baton()

    for wrong in ((1, baton), (baton,), (baton, baton, "long"), (baton, baton, 1.0, 2.0)):
        with pytest.raises((TypeError, AttributeError)):
            kind.pass_on(*wrong)


def test_an_event_baton_leaves_no_file_open() -> None:
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(100):
        python_batons.EventBaton()

    assert len(os.listdir("/proc/self/fd")) == before


def test_no_reference_to_a_baton_or_its_type_is_left(c_batons: Any) -> None:
    batons = [c_batons.Baton() for _ in range(3)]
    before = [sys.getrefcount(each) for each in (*batons, c_batons.Baton)]
    for _ in range(100):
        batons[0].give()
        c_batons.pass_on(batons[1], batons[0], 1.0)
        batons[1].take(0)
        batons[2].take(0)
        c_batons.Baton()
    after = [sys.getrefcount(each) for each in (*batons, c_batons.Baton)]

    assert after == before
