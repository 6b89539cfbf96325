"""Pacing by the wall clock: instants are never early, what comes in ends the wait, what goes out waits for its time.

Wall-clock tests bound one side only where a busy machine decides the other.
"""

from __future__ import annotations

import os
import re
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netem.gateways import Arrival, Gateway
from netem.gateways.lateness import OVERRUN_NS
from netem.gateways.pace import MOST_AT_ONCE, SPIN_NS, FromOutside, Overrun, Pace, Waited
from netem.gateways.real_time_process import in_real_time
from netem.gateways.real_time_settings import RealTimeSettings

MS = 1_000_000


class PipeGateway(Gateway):
    """A gateway to a pipe of this process: no mock of time, a real file that becomes readable."""

    def __init__(self, name: str = "out", medium: str = "line") -> None:
        super().__init__(name, medium, None)
        self._read, self._write = os.pipe()
        self.sent: list[tuple[int, bytes]] = []

    def fileno(self) -> int:
        return self._read

    def come_in(self, data: bytes) -> None:
        os.write(self._write, data)

    def receive(self, most: int) -> list[bytes]:
        return [os.read(self._read, 1000)]

    def send(self, data: bytes) -> None:
        self.sent.append((time.monotonic_ns(), data))

    def counters(self) -> dict[str, int]:
        return {"messages sent": len(self.sent)}

    def close(self) -> None:
        os.close(self._read)
        os.close(self._write)


class FloodedGateway(PipeGateway):
    """Messages have always come in already, however many are taken."""

    def __init__(self) -> None:
        super().__init__()
        self.come_in(b"always readable")

    def receive(self, most: int) -> list[bytes]:
        return [b"x"] * most


class SlowGateway(PipeGateway):
    """Taking in what has come takes `takes_s`, and then there was no message in it."""

    takes_s = 0.05

    def receive(self, most: int) -> list[bytes]:
        time.sleep(self.takes_s)
        os.read(self._read, 1000)
        return []


class StampingGateway(PipeGateway):
    """The system tells when messages arrived: at `at_ns` of the monotonic clock."""

    at_ns = 0

    def arrivals(self, most: int) -> list[Arrival]:
        return [Arrival(self.at_ns, data) for data in self.receive(most)]


class DueGateway(PipeGateway):
    """Nothing ever comes in, but it asks to receive at an instant of the wall clock."""

    at_ns = 0

    def due_ns(self) -> int:
        return self.at_ns

    def receive(self, most: int) -> list[bytes]:
        assert time.monotonic_ns() >= self.at_ns
        self.at_ns = 1 << 62
        return [b"made by itself"]


def test_no_instant_is_early_and_nothing_adds_up():
    pace = Pace()
    pace.start()
    began_ns = time.monotonic_ns()
    for k in range(1, 21):
        assert pace.wait(k * 2 * MS) == Waited(True, [])
        assert time.monotonic_ns() >= began_ns - MS + k * 2 * MS       # start() was less than 1 ms before

    assert pace.lateness.events == 20
    assert pace.now_ns() >= 40 * MS
    pace.close()


def test_what_comes_in_ends_the_wait():
    gateway = PipeGateway()
    pace = Pace([gateway])
    pace.start()
    gateway.come_in(b"hello")

    reached, [heard] = pace.wait(10**12)

    assert not reached
    assert heard == FromOutside("out", "line", b"hello", heard.at_ns)
    assert 0 <= heard.at_ns <= pace.now_ns()
    assert pace.wait(pace.now_ns()) == Waited(True, [])
    pace.close()


@pytest.mark.parametrize("rate", [1.0, 0.5])
def test_what_comes_in_gets_the_time_of_its_arrival_not_that_of_its_reading(rate):
    gateway = StampingGateway()
    pace = Pace([gateway], settings=RealTimeSettings(rate=rate))
    pace.start()
    time.sleep(0.01)
    gateway.at_ns = time.monotonic_ns()
    arrived_ns = pace.now_ns()
    gateway.come_in(b"hello")
    time.sleep(0.02)                            # the emulator is busy meanwhile

    _, [heard] = pace.wait(10**12)

    assert arrived_ns - MS < heard.at_ns <= arrived_ns
    pace.close()


def test_what_came_before_the_start_is_dropped_and_counted():
    gateway = StampingGateway()
    pace = Pace([gateway])
    gateway.at_ns = time.monotonic_ns()
    gateway.come_in(b"too early")
    pace.start()

    assert pace.wait(5 * MS) == Waited(True, [])
    assert pace.counters() == {"out": {"messages sent": 0, "messages before the start": 1}}
    pace.close()


def test_a_gateway_receives_at_the_instant_that_it_asks_for():
    gateway = DueGateway()
    pace = Pace([gateway])
    pace.start()
    gateway.at_ns = time.monotonic_ns() + 20 * MS

    assert pace.wait(5 * MS) == Waited(True, [])
    reached, [heard] = pace.wait(10**12)
    assert (reached, heard.data) == (False, b"made by itself")
    pace.close()


def test_an_overdue_instant_is_reached_at_once_however_many_messages_come():
    pace = Pace([FloodedGateway()])
    pace.start()
    time.sleep(2 * OVERRUN_NS * 1e-9)

    waits = [pace.wait(0) for _ in range(1_000)]

    assert all(wait.reached for wait in waits)
    assert {len(wait.heard) for wait in waits} == {1}           # and a run that is always late still hears the outside
    assert pace.lateness.events == 1_000
    assert pace.overruns == 1
    pace.close()


def test_one_wait_takes_in_a_bounded_number_of_messages():
    pace = Pace([FloodedGateway()])
    pace.start()

    wait = pace.wait(10**12)

    assert not wait.reached
    assert len(wait.heard) == MOST_AT_ONCE
    pace.close()


def test_a_wait_that_ends_late_counts_as_late():
    gateway = SlowGateway()
    pace = Pace([gateway])
    pace.start()
    gateway.come_in(b"noise")

    wait = pace.wait(pace.now_ns() + 5 * MS)

    assert wait == Waited(True, [])
    assert pace.lateness.worst_ns >= (gateway.takes_s * 1e9) - 5 * MS
    assert pace.overruns == 1
    pace.close()


def test_what_goes_out_leaves_in_order_and_not_before_its_time():
    gateway = PipeGateway()
    pace = Pace([gateway])
    pace.start()
    began_ns = time.monotonic_ns()
    pace.take("out", 20 * MS, b"later")
    pace.take("out", 10 * MS, b"first")
    pace.take("out", 20 * MS, b"last")
    pace.wait(30 * MS)

    assert [data for _, data in gateway.sent] == [b"first", b"later", b"last"]
    for (at_ns, _), due_ns in zip(gateway.sent, (10 * MS, 20 * MS, 20 * MS), strict=True):
        assert at_ns >= began_ns - MS + due_ns
    pace.close()


def test_lateness_is_how_far_behind_an_instant_began_and_a_stretch_of_it_is_one_event():
    told: list[tuple[int, str]] = []
    pace = Pace(event=lambda time_ns, kind, detail, level: told.append((time_ns, kind)))
    pace.start()
    time.sleep(0.05)
    pace.wait(1 * MS)
    pace.wait(2 * MS)
    pace.wait(pace.now_ns() + 5 * MS)       # caught up
    time.sleep(0.05)
    late_ns = pace.now_ns() - 40 * MS
    pace.wait(late_ns)

    assert told == [(1 * MS, "overrun"), (late_ns, "overrun")]
    assert pace.overruns == 2
    assert pace.lateness.worst_ns >= 48 * MS > OVERRUN_NS
    pace.close()


@given(st.floats(0.001, 1000.0), st.integers(0, 10**15))
def test_a_due_instant_is_the_first_at_which_virtual_time_has_come_so_far(rate: float, virtual_ns: int) -> None:
    pace = Pace(settings=RealTimeSettings(rate=rate))
    due_ns = pace.due_ns(virtual_ns)
    began_ns = pace.due_ns(0)

    def reached_ns(at_ns: int) -> int:
        return (at_ns - began_ns) * pace._virtual // pace._wall

    assert reached_ns(due_ns) >= virtual_ns
    assert due_ns == began_ns or reached_ns(due_ns - 1) < virtual_ns
    pace.close()


def test_at_half_the_rate_an_instant_comes_after_twice_the_time():
    pace = Pace(settings=RealTimeSettings(rate=0.5))
    before_ns = time.monotonic_ns()
    pace.start()
    pace.wait(10 * MS)

    assert time.monotonic_ns() - before_ns >= 20 * MS
    assert 10 * MS <= pace.now_ns() <= (time.monotonic_ns() - before_ns) // 2
    pace.close()


def test_a_wait_is_finer_than_the_time_out_of_a_selector():
    """A selector's time-out is rounded up to 1 ms, so half of the waits for random instants would be 0.5 ms late."""
    pace = Pace()
    with in_real_time(5):                       # where it is allowed, other load hardly matters
        pace.start()
        for k in range(1, 201):
            pace.wait(k * 1_370_000)

    assert pace.lateness.quantile_ns(0.25) < 500_000 - SPIN_NS  # a quarter, as a busy machine wakes it up late
    pace.close()


def test_no_drift_as_every_instant_is_counted_from_the_start():
    """Between 100 waits pass 1 ms or more each: sleeps of 4 ms one after the other would end 0.1 s behind."""
    pace = Pace()
    with in_real_time(5):
        pace.start()
        began_ns = time.monotonic_ns()
        for k in range(1, 101):
            pace.wait(k * 4 * MS)
            time.sleep(0.001 if k < 90 else 0.0)
        behind_ns = time.monotonic_ns() - began_ns - 400 * MS

    assert -MS <= behind_ns < 50 * MS
    pace.close()


@pytest.mark.parametrize("kind", ["the instant", "a frame to out"])
def test_an_overrun_beyond_the_limit_ends_the_run_if_it_is_to(kind: str) -> None:
    gateway = PipeGateway()
    pace = Pace([gateway], settings=RealTimeSettings(overrun="abort", overrun_limit_ns=3 * MS))
    pace.start()
    if kind != "the instant":
        pace.take("out", 1 * MS, b"late")
    time.sleep(0.02)

    with pytest.raises(Overrun, match=re.escape(f"{kind} at 0.001 s happened ") + r"[0-9.]+ ms behind the wall clock, "
                       r"more than real_time.overrun_limit_ms = 3: lower --rate, .* --overrun slip"):
        pace.wait(1 * MS)
    assert pace.overruns == 1
    pace.close()


def test_deliveries_are_late_by_the_time_after_they_are_due_and_never_early():
    gateway = PipeGateway()
    pace = Pace([gateway])
    pace.start()
    pace.take("out", 1 * MS, b"x")
    time.sleep(0.01)
    pace.wait(2 * MS)
    late_ns = pace.now_ns()
    pace.delivered(late_ns + 10**9)             # to a node, ahead of its arrival
    pace.delivered(late_ns - 5 * MS)

    assert pace.deliveries.events == 3
    assert pace.deliveries.quantile_ns(1 / 3) == 0
    assert pace.deliveries.quantile_ns(2 / 3) >= 5 * MS
    assert pace.deliveries.worst_ns >= 9 * MS
    pace.close()
