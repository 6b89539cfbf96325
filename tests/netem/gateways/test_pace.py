"""Pacing by the wall clock: instants are never early, what comes in ends the wait, what goes out waits for its time.

Wall-clock tests bound one side only where a busy machine decides the other.
"""

from __future__ import annotations

import os
import time

from netem.gateways import Gateway
from netem.gateways.lateness import OVERRUN_NS
from netem.gateways.pace import MOST_AT_ONCE, FromOutside, Pace, Waited

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

    assert pace.lateness.instants == 20
    assert pace.now_ns() >= 40 * MS
    pace.close()


def test_what_comes_in_ends_the_wait():
    gateway = PipeGateway()
    pace = Pace([gateway])
    pace.start()
    gateway.come_in(b"hello")

    assert pace.wait(10**12) == Waited(False, [FromOutside("out", "line", b"hello")])
    assert pace.wait(pace.now_ns()) == Waited(True, [])
    pace.close()


def test_a_gateway_receives_at_the_instant_that_it_asks_for():
    gateway = DueGateway()
    pace = Pace([gateway])
    pace.start()
    gateway.at_ns = time.monotonic_ns() + 20 * MS

    assert pace.wait(5 * MS) == Waited(True, [])
    assert pace.wait(10**12) == Waited(False, [FromOutside("out", "line", b"made by itself")])
    pace.close()


def test_an_overdue_instant_is_reached_at_once_however_many_messages_come():
    pace = Pace([FloodedGateway()])
    pace.start()
    time.sleep(2 * OVERRUN_NS * 1e-9)

    waits = [pace.wait(0) for _ in range(1_000)]

    assert all(wait.reached for wait in waits)
    assert {len(wait.heard) for wait in waits} == {1}           # and a run that is always late still hears the outside
    assert pace.lateness.instants == 1_000
    assert pace.lateness.overruns == 1
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
    assert pace.lateness.overruns == 1
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
    assert pace.lateness.overruns == 2
    assert pace.lateness.worst_ns >= 48 * MS > OVERRUN_NS
    pace.close()
