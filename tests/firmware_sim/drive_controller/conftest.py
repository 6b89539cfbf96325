"""A bench for a drive controller: delivers scripted frames at true instants, and records its frames with theirs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from random import Random
from typing import Any

import pytest

from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.drive_controller.drive_controller import DriveController
from firmware_sim.drive_controller.drive_messages import DriveMessage, DriveMessages, Mode, Setpoint
from firmware_sim.drive_controller.drive_settings import DriveSettings
from firmware_sim.local_clock import LocalClock
from fmus.build import build_model
from fmus.describe_fmu import describe
from fmus.plant import Plant
from netem.media.can.frame import unpack
from netem.node.node import Node
from netem.wire.messages import Grant, Report
from tests.firmware_sim.clock_faults import ClockSteps

MS = 1_000_000
MESSAGES = DriveMessages()


def run(left: float, right: float, counter: int = 1) -> Setpoint:
    return Setpoint(left, right, Mode.RUN, counter)


class DriveBench:
    def __init__(self, plant: Mapping[str, float] | None = None, clock: ClockSettings = ClockSettings(),
                 clock_steps: tuple[tuple[int, int], ...] = (), **settings: Any) -> None:
        self.node = Node("drive", ["can"])
        self.clock = LocalClock(clock, lambda: self.node.now_ns)
        self.plant = Plant(describe(build_model("unicycle")), "drive", plant or {}, present=self.node.present_ns)
        self.board = Board(self.node, self.clock, self.plant, {}, Random("7/drive"), {})
        self.board.keep_promises()
        self.board.take_faults()
        self._steps = ClockSteps(clock_steps)
        self.drive = DriveController(self.board, DriveSettings(**settings))
        self.node.start(self.drive.run())
        self.node.hello()
        self.messages = DriveMessages(unit=settings.get("unit", 0))
        self.offers: list[tuple[int, bytes]] = []
        self.events: list[tuple[int, str, str]] = []
        self.counters: dict[str, int] = {}
        self.firm_ns = 0
        self._deliveries: list[tuple[int, int, bytes]] = []

    def hears(self, at_ns: int, *frames: DriveMessage | bytes) -> DriveBench:
        packed = (frame if isinstance(frame, bytes) else self.messages.pack(frame) for frame in frames)
        self._deliveries += [(at_ns, 0, data) for data in packed]
        return self

    def until(self, end_ns: int) -> DriveBench:
        due = sorted((each for each in self._deliveries if each[0] < end_ns), key=lambda each: each[0])
        self._deliveries = [each for each in self._deliveries if each[0] >= end_ns]
        report: Report = self.node.advance(Grant(0, end_ns, False, True, due, self._steps.before(end_ns)))
        self.offers += [(time_ns, data) for time_ns, _, data in report.offers]
        self.events += [event[:3] for event in report.events]
        self.counters, self.firm_ns = report.counters, report.firm_ns
        return self

    def said(self, kind: type[DriveMessage]) -> list[tuple[int, Any]]:
        found = [(time_ns, self.messages.unpack(unpack(data))) for time_ns, data in self.offers]
        return [(time_ns, message) for time_ns, message in found if isinstance(message, kind)]

    def wheels(self) -> tuple[float, float]:
        return self.plant.get("wheel_left"), self.plant.get("wheel_right")


@pytest.fixture
def bench() -> Iterator[Callable[..., DriveBench]]:
    benches: list[DriveBench] = []

    def build(*given: Any, **settings: Any) -> DriveBench:
        benches.append(DriveBench(*given, **settings))
        return benches[-1]

    yield build
    for each in benches:
        each.plant.close()
