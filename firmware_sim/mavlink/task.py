"""The MAVLink front as a task of a board: serves its ports every period on the local clock.

    release: read the bytes received since the last one, up to the receive buffer   --execution_ns-->   send frames

It sends frames at these instants only, whatever arrives: its ports are `listen_only`. Each `port.send` is one MAVLink
frame, and one datagram behind a UDP gateway.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from functools import partial
from typing import Any

from simpy.events import Event

from firmware_sim.autopilot.vehicle import Vehicle
from firmware_sim.board import Board
from firmware_sim.mavlink.counters import FRONT_COUNTERS, BoardCounters
from firmware_sim.mavlink.front import MavlinkFront
from firmware_sim.mavlink.settings import MavlinkSettings
from firmware_sim.schedules.periodic import Periodic


class MavlinkTask:
    def __init__(self, board: Board, ports: Sequence[str], vehicle: Vehicle, settings: MavlinkSettings) -> None:
        self._board = board
        self._ports = [board.port(port, partial(self._hear, number), listen_only=True)
                       for number, port in enumerate(ports)]
        self._schedule = Periodic(settings.period_ns, settings.offset_ns)
        self._execution_ns = settings.execution_ns
        self._room = settings.receive_buffer_bytes
        self._heard = [bytearray() for _ in ports]
        self._counters = BoardCounters(board, FRONT_COUNTERS)
        self.front = MavlinkFront(vehicle, settings, board.event, names=ports)

    def run(self) -> Generator[Event, Any, None]:
        board = self._board
        release_ns = self._schedule.next_after(board.now_ns - 1)
        while True:
            yield from board.sleep_until(release_ns, silent_until_ns=release_ns + self._execution_ns)
            frames = self.front.step([bytes(heard) for heard in self._heard], board.now_ns)
            for heard in self._heard:
                heard.clear()
            self._counters.note(self.front.counts)
            yield from board.sleep_until(release_ns + board.execution_ns(self._execution_ns))
            for port, of_port in zip(self._ports, frames, strict=True):
                for frame in of_port:
                    port.send(frame)
            release_ns = self._schedule.next_after(board.now_ns)

    def _hear(self, port: int, data: bytes) -> None:
        heard = self._heard[port]
        room = self._room - len(heard)
        if len(data) > room:
            self.front.counts["bytes overrun"] += len(data) - room
        heard += data[:room]
