"""A bench for a quadrotor: the plant's FMU, the board's program, and a scripted motion capture and link."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from random import Random
from typing import Any

import pytest

from firmware_sim.autopilot.autopilot import Autopilot
from firmware_sim.autopilot.autopilot_settings import AutopilotSettings
from firmware_sim.autopilot.vehicle import Landed, Mode, Result, Target, Vector
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from fmus.build import MODELS, build_model
from fmus.describe import read_model
from fmus.describe_fmu import describe
from fmus.plant import Plant
from fmus.presets import read_presets
from netem.media.sensing.sight import Detection, pack_detection
from netem.node.node import Node
from netem.wire.messages import Grant
from tests.firmware_sim.clock_faults import ClockSteps

MS = 1_000_000
EXPOSURES_NS, LATENCY_NS = 10 * MS, 8 * MS
PRESETS = read_presets(MODELS / "quadrotor", read_model(MODELS / "quadrotor/variables.toml"))


class FlightBench:
    """Advances in steps of an exposure.

    `captured` and `heard` turn motion capture and link on; the target `commanded` is repeated at every step.
    """

    def __init__(self, plant: Mapping[str, Any] | None = None, clock: ClockSettings = ClockSettings(),
                 clock_steps: tuple[tuple[int, int], ...] = (), noise_m: float = 0.001,
                 sample_period_ns: int = 0, **settings: Any) -> None:
        settings["parameters"] = {"MOCAP_DELAY": LATENCY_NS / 1e9} | settings.get("parameters", {})
        self.node = Node("uav", ["mocap"], sample_period_ns)
        start = PRESETS["hummingbird"].parameters | dict(plant or {})
        self.now_ns = 0                 # to where it went on, and where the plant is
        self.plant = Plant(describe(build_model("quadrotor")), "uav", start,
                           present=lambda: max(self.node.present_ns(), self.now_ns))
        self.clock = LocalClock(clock, lambda: self.node.now_ns)
        self.board = Board(self.node, self.clock, self.plant, {}, Random("7/uav"), {})
        self.board.keep_promises()
        self.board.take_faults()
        self._steps = ClockSteps(clock_steps)
        self.autopilot = Autopilot(self.board, AutopilotSettings(**settings))
        self.controller = self.autopilot.controller
        self.node.start(self.autopilot.run())
        self.node.hello()
        self.captured, self.heard = True, True
        self.commanded: Target | None = None        # repeated at every step
        self.notices: list[str] = []
        self.autopilot.listeners.append(lambda _severity, text: self.notices.append(text))
        self.counters: dict[str, int] = {}
        self.samples: list[tuple[int, list[float]]] = []
        self._rng, self._noise_m = Random("7/noise"), noise_m
        self._position = self.plant.output_group(["x", "y", "z"])
        self._deliveries: list[tuple[int, int, bytes]] = []

    def run(self, seconds: float, watch: Callable[[], None] = lambda: None) -> FlightBench:
        end_ns = self.now_ns + round(seconds * 1e9)
        while self.now_ns < end_ns:
            if self.heard:
                self.controller.link_heard(self.board.now_ns)
            if self.commanded is not None:
                self.controller.target(self.commanded, self.board.now_ns)
            if self.captured:
                place = (each + self._rng.gauss(0.0, self._noise_m) for each in self._position.read())
                self.hears(self.now_ns + LATENCY_NS, pack_detection(Detection(self.now_ns, *place, "uav")))
            next_ns = self.now_ns + EXPOSURES_NS
            report = self.node.advance(Grant(0, next_ns, False, True, sorted(self._deliveries),
                                             self._steps.before(next_ns)))
            self.now_ns = next_ns
            self._deliveries = []
            self.counters = report.counters
            self.samples += report.samples
            watch()
        return self

    def hears(self, at_ns: int, data: bytes) -> None:
        self._deliveries.append((at_ns, 0, data))

    def ned(self) -> Vector:
        """True position (north, east, down) in m."""
        x, y, z = self._position.read()
        return y, x, -z

    def flying(self, height_m: float = 1.0) -> FlightBench:
        """Take off, and hold the height until the vehicle has settled."""
        self.run(0.2)
        assert self.controller.arm() is Result.ACCEPTED
        assert self.controller.take_off(height_m) is Result.ACCEPTED
        self.run(7.0)
        assert (self.controller.state().mode, self.controller.state().landed) == (Mode.HOLD, Landed.IN_AIR)
        return self

    def fly_to(self, target: Target, seconds: float, watch: Callable[[], None] = lambda: None) -> FlightBench:
        self.commanded = target
        self.controller.target(target, self.board.now_ns)
        assert self.controller.set_mode(Mode.OFFBOARD) is Result.ACCEPTED
        return self.run(seconds, watch)


@pytest.fixture
def bench() -> Iterator[Callable[..., FlightBench]]:
    benches: list[FlightBench] = []

    def build(*given: Any, **settings: Any) -> FlightBench:
        benches.append(FlightBench(*given, **settings))
        return benches[-1]

    yield build
    for each in benches:
        each.plant.close()
