"""A stream of datagrams: one of `size_bytes` to `destination` every period, as a camera, a status or a joystick sends.

The payload begins with the number of the datagram, 4 bytes, little endian; zeros follow.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from firmware_sim.board import Board
from netem.media.packet_network.datagram import Datagram, pack, unpack

NUMBER_BYTES = 4


@dataclass(frozen=True)
class StreamSettings:
    destination: str            # a node, a group of the medium, or "*"
    size_bytes: int             # of the payload, at least 4
    period_ns: int
    offset_ns: int = 0
    port: str = "lan"

    def __post_init__(self) -> None:
        if self.size_bytes < NUMBER_BYTES:
            raise ValueError(f"size_bytes={self.size_bytes}: expected at least {NUMBER_BYTES}: the number of the "
                             "datagram")
        if self.period_ns < 1 or self.offset_ns < 0:
            raise ValueError(f"period_ns={self.period_ns}, offset_ns={self.offset_ns}: expected a period of at least "
                             "1 ns and an offset of at least 0")


class Stream:
    Settings = StreamSettings

    def __init__(self, board: Board, settings: StreamSettings) -> None:
        self._board, self._settings = board, settings
        self._port = board.port(settings.port, self._heard, listen_only=True)
        self._sent = 0
        self._newest: Counter[str] = Counter()              # by source: number of the newest datagram + 1
        for counter in ("datagrams heard", "unreadable frames", "datagrams out of order"):
            board.count(counter, 0)
        board.every(settings.period_ns, self._send, offset_ns=settings.offset_ns)

    def _send(self) -> None:
        payload = self._sent.to_bytes(NUMBER_BYTES, "little") + bytes(self._settings.size_bytes - NUMBER_BYTES)
        self._port.send(pack(Datagram(self._settings.destination, payload)))
        self._sent += 1

    def _heard(self, frame: bytes) -> None:
        datagram = unpack(frame)
        if datagram is None or len(datagram.payload) < NUMBER_BYTES:
            self._board.count("unreadable frames")
            return
        self._board.count("datagrams heard")
        number = int.from_bytes(datagram.payload[:NUMBER_BYTES], "little")
        if number < self._newest[datagram.source]:
            self._board.count("datagrams out of order")
        else:
            self._newest[datagram.source] = number + 1
