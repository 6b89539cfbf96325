"""Pacing by the wall clock: instants are never early, what comes in ends the wait, what goes out waits for its time.

Wall-clock tests bound one side only where a busy machine decides the other.
"""

from __future__ import annotations

import os
import time

from netem.real_time.pace import OVERRUN_NS, FromOutside, Pace

MS = 1_000_000


class PipeGateway:
    """A gateway to a pipe of this process: no mock of time, a real file that becomes readable."""

    def __init__(self, name: str = "out", medium: str = "line") -> None:
        self.name, self.medium = name, medium
        self._read, self._write = os.pipe()
        self.sent: list[tuple[int, bytes]] = []

    def fileno(self) -> int:
        return self._read

    def come_in(self, data: bytes) -> None:
        os.write(self._write, data)

    def receive(self) -> list[bytes]:
        return [os.read(self._read, 1000)]

    def send(self, data: bytes) -> None:
        self.sent.append((time.monotonic_ns(), data))

    def close(self) -> None:
        os.close(self._read)
        os.close(self._write)


def test_no_instant_is_early_and_nothing_adds_up():
    pace = Pace()
    pace.start()
    began_ns = time.monotonic_ns()
    for k in range(1, 21):
        assert pace.wait(k * 2 * MS) == []
        assert time.monotonic_ns() >= began_ns - MS + k * 2 * MS       # start() was less than 1 ms before

    assert pace.lateness.instants == 20
    assert pace.now_ns() >= 40 * MS
    pace.close()


def test_what_comes_in_ends_the_wait():
    gateway = PipeGateway()
    pace = Pace([gateway])
    pace.start()
    gateway.come_in(b"hello")

    assert pace.wait(10**12) == [FromOutside("out", "line", b"hello")]
    assert pace.wait(pace.now_ns()) == []
    pace.close()


def test_what_goes_out_leaves_in_order_and_not_before_its_time():
    gateway = PipeGateway()
    pace = Pace([gateway])
    pace.start()
    began_ns = time.monotonic_ns()
    assert pace.take("out", 20 * MS, b"later")
    assert pace.take("out", 10 * MS, b"first")
    assert pace.take("out", 20 * MS, b"last")
    assert not pace.take("nobody", 0, b"")
    pace.wait(30 * MS)

    assert [data for _, data in gateway.sent] == [b"first", b"later", b"last"]
    for (at_ns, _), due_ns in zip(gateway.sent, (10 * MS, 20 * MS, 20 * MS), strict=True):
        assert at_ns >= began_ns - MS + due_ns
    pace.close()


def test_lateness_is_how_far_behind_an_instant_began_and_a_stretch_of_it_is_one_event():
    told: list[tuple[int, str]] = []
    pace = Pace(event=lambda time_ns, kind, detail: told.append((time_ns, kind)))
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
