"""The guest's MAVLink telemetry on a medium of its node: each datagram is a frame, each frame a datagram.

    guest --UDP--> socket --at the next step--> port of the node --> medium, ground station, other robots
          <--UDP--        <--at its arrival----

A datagram gets the instant of the step at which the node takes it, so a message of the guest is late by less than a
step. What it sent before the first step is dropped. The guest's messages of one step are all there when its answer to
that step is: both pass through the loopback.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from firmware_sim.board import Board
from firmware_sim.guests.door import Datagrams, loopback_address


@dataclass(frozen=True)
class TelemetrySettings:
    port: str = ""                          # of the node; "": its only one, none if it has none
    listen: str = "127.0.0.1:14550"         # address to which the guest sends its telemetry

    def __post_init__(self) -> None:
        loopback_address("listen", self.listen)

    def port_of(self, ports: Collection[str]) -> str | None:
        """Return the name of the port; None if the node is on no medium. Raises ValueError if it is unclear."""
        if not ports and not self.port:
            return None
        name = self.port or (next(iter(ports)) if len(ports) == 1 else "")
        if name not in ports:
            raise ValueError(f"telemetry.port={self.port!r}: expected one of {', '.join(ports) or 'no medium'}; name "
                             "the medium on which the autopilot's telemetry is sent")
        return name


class Telemetry:
    def __init__(self, board: Board, settings: TelemetrySettings) -> None:
        self._board = board
        name = settings.port_of(board.ports)
        self._port = None if name is None else board.port(name, self._heard)
        self._socket = None if name is None else Datagrams(
            f"agents.{board.name}", loopback_address("telemetry.listen", settings.listen), "telemetry.listen")
        if self._socket is not None:
            board.at_end(self._socket.close)
        for counter in ("telemetry sent", "telemetry received", "telemetry without guest"):
            board.count(counter, 0)

    def begin(self) -> None:
        """Drop what has arrived: how much a guest says before its first step depends on when it was started."""
        if self._socket is not None:
            while self._socket.receive_all():
                pass

    def pass_on(self) -> None:
        """Send on the medium what has arrived from the guest."""
        if self._socket is not None and self._port is not None:
            for data in self._socket.receive_all():
                self._port.send(data)
                self._board.count("telemetry sent")

    def _heard(self, data: bytes) -> None:
        assert self._socket is not None
        self._board.count("telemetry received" if self._socket.send(data) else "telemetry without guest")
