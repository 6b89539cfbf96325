"""A UDP endpoint on the loopback as a gateway: each datagram is one message.

It speaks to `peer` until somebody else speaks to it, and from then on to who spoke last: ground stations and clients
that listen get the first heartbeat, those that call are answered.
"""

from __future__ import annotations

import socket
from contextlib import suppress
from typing import Final

Address = tuple[str, int]

LARGEST_DATAGRAM: Final = 65_535
MOST_AT_ONCE: Final = 1_000          # so that a flood from outside never keeps the emulator from its own work


class UdpGateway:
    def __init__(self, name: str, medium: str, listen: Address, peer: Address | None = None) -> None:
        """Listen on `listen`, port 0 for one that the system chooses. OSError says what cannot be listened on."""
        self.name = name
        self.medium = medium
        self.peer = peer
        self.received = self.sent = self.unsent = 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            self._socket.bind(listen)
        except OSError as error:
            self._socket.close()
            raise OSError(f"gateways.{name}: cannot listen on {listen[0]}:{listen[1]}: {error.strerror}") from error
        self.listening: Address = self._socket.getsockname()

    def fileno(self) -> int:
        return self._socket.fileno()

    def receive(self) -> list[bytes]:
        found: list[bytes] = []
        while len(found) < MOST_AT_ONCE:
            try:
                data, self.peer = self._socket.recvfrom(LARGEST_DATAGRAM)
            except BlockingIOError:
                break
            except ConnectionError:         # the answer of a peer that does not listen (yet)
                continue
            found.append(data)
        self.received += len(found)
        return found

    def send(self, data: bytes) -> None:
        if self.peer is not None:
            with suppress(OSError):
                self._socket.sendto(data, self.peer)
                self.sent += 1
                return
        self.unsent += 1

    def close(self) -> None:
        self._socket.close()
