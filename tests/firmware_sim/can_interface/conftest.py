"""Blocking programs on the nodes of one CAN bus, all in this process."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from random import Random
from typing import Any

import pytest

from firmware_sim.blocking.library_time import library_in_virtual_time
from firmware_sim.blocking.node import BlockingNode
from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from firmware_sim.sockets.library_sockets import sockets_in_virtual_time
from netem.core.agenda import Agenda
from netem.emulator.conductor import Conductor, Recorders
from netem.media.can.bus import CanBus
from netem.media.can.settings import CanSettings
from netem.media.links import Links
from netem.records.ledger import Ledger
from netem.transport.hosts import InlineHost
from netem.wire.messages import Grant

SECOND_NS = 1_000_000_000
CAN_BUSES = ("can0", "can1")


@dataclass
class Robots:
    """`run` runs programs on one bus of 500 kbit/s; `alone` runs one program with deliveries from the test."""

    programs: list[BlockingProgram] = field(default_factory=list)

    def begin(self, name: str, function: Callable[..., object], ports: Sequence[str] = ("can0",),
              own_frames: Sequence[str] = (), **clock: Any) -> BlockingNode:
        node = BlockingNode(name, ports)
        settings = ClockSettings(**clock)
        board = Board(node, LocalClock(settings, node.env.time_ns), None, {}, Random(f"7/{name}"), {})
        node.program = BlockingProgram(node, board, settings, lambda: function, {},
                                       [port for port in ports if port in CAN_BUSES], own_frames)
        self.programs.append(node.program)
        node.program.begin()
        return node

    def alone(self, function: Callable[..., object], deliveries: Sequence[tuple[int, bytes]] = (),
              until_ns: int = 10 * SECOND_NS, **rest: Any) -> tuple[list[tuple[int, bytes]], dict[str, int]]:
        """Run `function` with deliveries (time, bytes) at `can0`; returns its offers (time, bytes) and counters."""
        node = self.begin("robot", function, **rest)
        report = node.advance(Grant(1, until_ns, False, True, [(time_ns, 0, data) for time_ns, data in deliveries]))
        return [(time_ns, data) for time_ns, _, data in report.offers], report.counters

    def run(self, functions: Mapping[str, Callable[..., object]], until_ns: int = SECOND_NS,
            **settings: Any) -> Conductor:
        own = settings.get("own_frames_to", ())
        build = {name: (lambda name=name, function=function: self.begin(
            name, function, own_frames=["can0"] if name in own else [])) for name, function in functions.items()}
        agenda, ledger = Agenda(), Ledger()
        conductor = Conductor(agenda, InlineHost(build), until_ns, Recorders())
        links = Links(ledger, conductor.deliver, {})
        bus = CanBus("can0", CanSettings(**{"bit_rate_bps": 500_000, **settings}), list(functions), agenda, ledger,
                     links, Random)
        conductor.admit(conductor.host.start(), {"can0": bus})
        conductor.run()
        bus.finish(until_ns)
        ledger.finish(end_ns=until_ns)
        return conductor


@pytest.fixture
def robots(caplog: pytest.LogCaptureFixture) -> Iterator[Robots]:
    caplog.set_level("ERROR", "can")            # python-can warns of buses that programs of tests do not close
    with library_in_virtual_time(), sockets_in_virtual_time():
        found = Robots()
        try:
            yield found
        finally:
            for program in found.programs:
                program.finish()
                for (kind, _), channel in program.shared.items():
                    for bus in list(channel.buses) if kind == "can" else ():
                        bus.shutdown()
