"""How a run is held, with a clock and a conductor that the test drives."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable

from experiments.run.live.steering import PACED_S, Steering

MS = 1_000_000


class Stops:
    """A conductor that goes from stop to stop."""

    def __init__(self) -> None:
        self.passed_ns = self.stop_ns = 0
        self.waiting: list[tuple[int, Callable[[], None]]] = []

    def stop_at(self, time_ns: int, action: Callable[[], None]) -> None:
        assert time_ns >= self.passed_ns
        self.waiting.append((time_ns, action))

    def next(self) -> int | None:
        """Go to the next stop and return its instant; None if nothing holds the run any more."""
        if not self.waiting:
            return None
        self.stop_ns, action = self.waiting.pop(0)
        self.passed_ns = self.stop_ns
        action()
        return self.stop_ns


def test_a_run_that_nobody_watches_is_not_held() -> None:
    conductor = Stops()
    steering = Steering(conductor)      # type: ignore[arg-type]
    steering.pause()
    began_s = time.monotonic()

    assert not steering.await_page(0.05)
    steering.poll()
    assert conductor.next() is None
    assert time.monotonic() - began_s >= 0.05
    steering.close()


def test_stops_come_at_the_pace_of_the_clock_and_do_not_drift() -> None:
    conductor = Stops()
    steering = Steering(conductor)      # type: ignore[arg-type]
    steering.watched(1)
    steering.choose(4.0)
    steering.poll()
    began_s = time.monotonic()

    instants = [conductor.next() for _ in range(11)]

    step_ns = round(4 * PACED_S * 1e9)
    assert instants == [k * step_ns for k in range(11)]
    assert time.monotonic() - began_s >= 10 * PACED_S - 0.001      # select counts whole milliseconds
    steering.close()


def test_what_arrives_in_a_pause_is_attended_to_and_ends_it() -> None:
    conductor = Stops()
    steering = Steering(conductor)      # type: ignore[arg-type]
    here, there = socket.socketpair()
    steering.attend(here, lambda: (here.recv(1), steering.go(), steering.choose(None)))
    steering.watched(1)
    steering.pause()
    steering.poll()
    there.send(b"x")

    assert conductor.next() == 0        # returns, as the pause ends
    assert conductor.next() is None     # as fast as possible: no stop follows
    steering.leave(here)
    here.close()
    there.close()
    steering.close()


def test_a_slow_stretch_is_not_made_up_for_without_bound() -> None:
    clock_s = [100.0]
    conductor = Stops()
    steering = Steering(conductor, lambda: clock_s[0])      # type: ignore[arg-type]
    steering.watched(1)
    steering.poll()
    conductor.next()
    clock_s[0] += 60                    # the first windows took a minute
    assert conductor.next() == 20 * MS
    conductor.next()                    # counts from here on

    assert steering._anchor == (160.0, 40 * MS)
    steering.close()
