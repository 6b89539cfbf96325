"""The drive controller on a CAN bus under the conductor, with a companion that commands it and a node that babbles."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from math import pi
from random import Random
from typing import Any

import pytest

from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.drive_controller.drive_controller import DriveController
from firmware_sim.drive_controller.drive_messages import (
    DriveMessage,
    DriveMessages,
    DriveState,
    Mode,
    Odometry,
    Setpoint,
    Status,
    WheelSpeeds,
)
from firmware_sim.drive_controller.drive_settings import DriveSettings
from firmware_sim.local_clock import LocalClock
from fmus.build import build_model
from fmus.describe_fmu import describe
from fmus.plant import Plant
from netem.core.agenda import Agenda
from netem.core.fate import Fate
from netem.emulator.conductor import Conductor, Recorders
from netem.media.can.bus import CanBus
from netem.media.can.frame import CanFrame, pack, unpack
from netem.media.can.settings import CanSettings
from netem.media.links import Links
from netem.node.node import Node
from netem.records.ledger import COLUMNS, Ledger
from netem.transport.hosts import InlineHost

MS = 1_000_000
END_NS = 1500 * MS
BIT_NS = 2_000                  # 500 kbit/s
LONGEST_NS = (8 * 8 + 47 + (34 + 8 * 8 - 1) // 4) * BIT_NS          # 8 bytes, most stuff bits, with interframe space
NODES = ("babbler", "companion", "drive")
MESSAGES = DriveMessages()


class CanRun:
    """The three of them for `END_NS`; `babble` is when the babbler sends its frames of highest priority."""

    def __init__(self, babble: Callable[[Node], Iterator[Any]] | None = None) -> None:
        self.events: list[tuple[int, str, str, str]] = []
        self.heard: list[tuple[int, DriveMessage]] = []         # by the companion
        self._babble = babble
        builders = {"companion": self._companion, "drive": self._drive, "babbler": self._babbler}
        recorders = Recorders(lambda *_: None, lambda *event: self.events.append(event))
        conductor = Conductor(Agenda(), InlineHost({name: builders[name] for name in NODES}), END_NS, recorders)
        self.ledger = Ledger()
        links = Links(self.ledger, conductor.deliver, {}, END_NS)
        self.bus = CanBus("can", CanSettings(bit_rate_bps=500_000, queue="mailbox"), NODES, conductor.agenda,
                          self.ledger, links, lambda place: Random(f"7/{place}"))
        conductor.admit(conductor.host.start(), {"can": self.bus})
        conductor.run()
        self.bus.finish(END_NS)
        self.counters = conductor.counters
        self.result = self.ledger.finish()
        self.plant.close()

    def _drive(self) -> Node:
        node = Node("drive", ["can"], sample_period_ns=10 * MS)
        self.plant = Plant(describe(build_model("unicycle")), "drive", {"tau_wheel_s": 0.05},
                           present=node.present_ns)
        board = Board(node, LocalClock(ClockSettings(), node.env.time_ns), self.plant, {}, Random("7/drive"), {})
        board.keep_promises()
        node.start(DriveController(board, DriveSettings(stale_after_ns=100 * MS, lag_ns=50 * MS)).run())
        return node

    def _companion(self) -> Node:
        """Asks for (5, 3) rad/s every 20 ms."""
        node = Node("companion", ["can"])
        port = node.ports["can"]
        port.on_receive = lambda data: self._note(node.now_ns, data)

        def command() -> Iterator[Any]:
            for k in range(10**9):
                port.send(MESSAGES.pack(Setpoint(5.0, 3.0, Mode.RUN, k % 256)))
                yield node.env.timeout(20 * MS)

        node.start(command())
        return node

    def _note(self, now_ns: int, data: bytes) -> None:
        message = MESSAGES.unpack(unpack(data))
        if message is not None:
            self.heard.append((now_ns, message))

    def _babbler(self) -> Node:
        node = Node("babbler", ["can"])
        if self._babble is not None:
            node.start(self._babble(node))
        return node

    def of(self, kind: type[DriveMessage]) -> list[tuple[int, Any]]:
        return [(time_ns, message) for time_ns, message in self.heard if isinstance(message, kind)]

    def rows(self) -> list[dict[str, Any]]:
        return [dict(zip(COLUMNS, row, strict=True)) for row in self.ledger.rows]

    def kinds(self) -> list[tuple[int, str]]:
        return [(time_ns, kind) for node, time_ns, kind, _ in self.events if node == "drive"]


def babble_from_to(start_ns: int, end_ns: int, node: Node) -> Iterator[Any]:
    """Frames of the highest priority, each handed out before the one before is over: nobody else gets the bus."""
    yield node.env.timeout(start_ns)
    while node.now_ns < end_ns:
        node.ports["can"].send(pack(CanFrame(0x001, bytes(8))))
        yield node.env.timeout(200_000)         # 111 bits without stuff bits take 222 us


@pytest.fixture(scope="module")
def calm() -> CanRun:
    return CanRun()


def test_setpoints_arrive_and_odometry_comes_back_over_the_bus(calm: CanRun) -> None:
    last = calm.of(WheelSpeeds)[-1][1]

    assert +Counter(calm.counters["drive"]) == {"setpoints taken": END_NS // (20 * MS)}
    assert (last.left_radps, last.right_radps) == pytest.approx((5.0, 3.0), abs=0.1)
    assert {len(calm.of(kind)) for kind in (WheelSpeeds, Odometry)} == {END_NS // (10 * MS)}
    assert len(calm.of(Status)) == END_NS // (100 * MS)
    assert calm.kinds() == [(10 * MS, "drive running")]         # the first setpoint takes 0.2 ms, after release 0
    assert set(calm.result.by_fate) == {"delivered"}


def test_a_confirmation_comes_back_within_one_period_its_execution_and_the_frames_before_it(calm: CanRun) -> None:
    """A setpoint waits at most one period for its release; 10.3 ms later its counter is on the bus."""
    late_ns = [at_ns - k * 20 * MS for k in range(70)
               for at_ns in [next(time_ns for time_ns, message in calm.of(WheelSpeeds)
                                  if message.counter == k % 256 and message.state == 1)]]

    assert min(late_ns) > 300_000
    assert max(late_ns) <= 10 * MS + 300_000 + 2 * LONGEST_NS


def test_the_odometry_on_the_bus_is_as_old_as_its_execution_and_its_frames(calm: CanRun) -> None:
    ages_ns = {time_ns % (10 * MS) for time_ns, _ in calm.of(Odometry)}

    assert min(ages_ns) > 300_000
    assert max(ages_ns) <= 300_000 + 3 * LONGEST_NS             # a frame under way, the speeds', its own


def test_a_bus_that_is_babbled_full_starves_the_setpoints_and_the_drive_stops_until_they_come_again() -> None:
    run = CanRun(partial(babble_from_to, 500 * MS, 1200 * MS))

    (_, first), (stale_ns, second), (recovered_ns, third) = run.kinds()
    assert (first, second, third) == ("drive running", "setpoint stale", "setpoint recovered")
    # the last setpoint came at 480 ms or, if it was first on the bus, at 500 ms; 100 ms later and at a release
    assert 580 * MS <= stale_ns <= 610 * MS
    # the mailboxes hold one frame of each kind at 1200 ms
    assert 1200 * MS <= recovered_ns <= 1200 * MS + 5 * LONGEST_NS + 10 * MS
    # nothing gets by the babbler, so nobody but the record could tell that the wheels stand
    assert [time_ns for time_ns, _ in run.heard if 500 * MS + 4 * LONGEST_NS < time_ns < 1200 * MS] == []
    after = [message for time_ns, message in run.of(WheelSpeeds) if 1200 * MS < time_ns < recovered_ns]
    assert after
    assert all((message.state, message.left_radps) == (DriveState.STALE, 0.0) for message in after)
    # 5 rad/s from 10 ms on until stale, then 20 rad/s2 to rest in steps of 10 ms; the wheels' lag cancels
    angle = run.of(Odometry)[-1 - sum(time_ns > recovered_ns for time_ns, _ in run.of(Odometry))][1].left_count
    assert angle * 2 * pi / 16384 == pytest.approx(5 * (stale_ns / 1e9 - 0.01) + 25 / 40, abs=0.05)
    assert run.of(WheelSpeeds)[-1][1].left_radps == pytest.approx(5.0, abs=0.1)
    # nothing is lost without a trace: the bus closed every copy, the drive counted every setpoint that it was given
    fates = [row for row in run.rows() if (row["sender"], row["receiver"]) == ("companion", "drive")]
    assert len(fates) == END_NS // (20 * MS)
    assert sum(row["fate"] == Fate.DELIVERED.value for row in fates) == run.counters["drive"]["setpoints taken"]


def test_the_same_run_gives_the_same_ledger(calm: CanRun) -> None:
    again = CanRun()

    assert again.result.hash == calm.result.hash
    assert again.events == calm.events
