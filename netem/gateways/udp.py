"""A UDP endpoint on the loopback as a gateway: each datagram is one message, to and from one peer.

The first address that sends to the gateway becomes its peer. Until then the gateway sends to the configured `peer`, if
there is one, so that a ground station which waits for a heartbeat gets the first. A datagram from another address is
refused: dropped, counted, and recorded as an event once for each address. If the peer has sent nothing for
PEER_SILENT_NS, another address may replace it, which is also an event; so a ground station may restart on another port.

Not modelled: several peers at a time; messages longer than a datagram.
"""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from ipaddress import ip_address
from typing import ClassVar, Final

from netem.wire.level import Level

Address = tuple[str, int]

LARGEST_DATAGRAM: Final = 65_535
PEER_SILENT_NS: Final = 10_000_000_000
ADDRESS_RULE: Final = "expected \"127.0.0.1:port\": an address of the loopback and a port from 0 to 65535"
MOST_TOLD: Final = 20               # refused addresses with an event each; further ones are only counted


@dataclass(frozen=True)
class UdpSettings:
    """Addresses of the loopback, as "127.0.0.1:port"."""

    listen: str = "127.0.0.1:0"         # port 0: the system chooses
    peer: str | None = None             # address to send to until the first datagram arrives

    def __post_init__(self) -> None:
        given = {"listen": self.listen} if self.peer is None else {"listen": self.listen, "peer": self.peer}
        wrong = [key for key, text in given.items() if not is_address(text)]
        if wrong:
            raise ValueError("\n".join(f"{key}={given[key]}: {ADDRESS_RULE}" for key in wrong))


class UdpGateway:
    """A gateway to one UDP peer.

    Invariants:
    - `received + refused` is the number of datagrams read, `sent + unsent` that of calls of `send`;
    - the peer changes only by the first datagram, or after PEER_SILENT_NS without a datagram from it.
    """

    Settings: ClassVar = UdpSettings

    def __init__(self, name: str, medium: str, settings: UdpSettings, *,
                 event: Callable[[str, str, Level], None] = lambda kind, detail, level: None,
                 clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        """Bind the socket; raises OSError, with the address, if that fails.

        `event` takes a kind, a detail and a level; `clock_ns` is the clock that measures the silence of the peer.
        """
        self.name = name
        self.medium = medium
        listen = address_of(settings.listen)
        self.peer = None if settings.peer is None else address_of(settings.peer)
        self.received = self.refused = self.sent = self.unsent = 0
        self._event, self._clock_ns = event, clock_ns
        self._spoke_ns: int | None = None           # time of the peer's last datagram; None: none yet
        self._told: set[Address] = set()            # refused addresses with an event
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

    def receive(self, most: int) -> list[bytes]:
        found: list[bytes] = []
        for _ in range(most):
            try:
                data, sender = self._socket.recvfrom(LARGEST_DATAGRAM)
            except BlockingIOError:
                break
            except ConnectionError:         # ICMP: nothing listens at the peer's port
                continue
            if self._is_peer(sender):
                found.append(data)
                self.received += 1
            else:
                self.refused += 1
        return found

    def send(self, data: bytes) -> None:
        if self.peer is not None:
            with suppress(OSError):
                self._socket.sendto(data, self.peer)
                self.sent += 1
                return
        self.unsent += 1

    def counters(self) -> dict[str, int]:
        return {"datagrams received": self.received, "datagrams refused": self.refused,
                "datagrams sent": self.sent, "datagrams not sent": self.unsent}

    def close(self) -> None:
        self._socket.close()

    def _is_peer(self, sender: Address) -> bool:
        """Return whether `sender` is the peer; make it the peer if there is none or the peer has been silent."""
        now_ns = self._clock_ns()
        if sender != self.peer or self._spoke_ns is None:
            if self._spoke_ns is not None and now_ns - self._spoke_ns < PEER_SILENT_NS:
                self._refuse(sender)
                return False
            before = "" if self._spoke_ns is None else f" instead of {_text(self.peer)}, which has been silent"
            self._event("gateway peer", f"gateways.{self.name} speaks with {_text(sender)}{before}", Level.INFO)
            self.peer = sender
            self._told.discard(sender)
        self._spoke_ns = now_ns
        return True

    def _refuse(self, sender: Address) -> None:
        if sender in self._told or len(self._told) >= MOST_TOLD:
            return
        self._told.add(sender)
        self._event("gateway peer refused", f"gateways.{self.name} speaks with {_text(self.peer)}: datagrams of "
                    f"{_text(sender)} are dropped; give it a gateway of its own", Level.WARNING)


def is_address(text: str) -> bool:
    """Return whether `text` is an address of the loopback with a port."""
    try:
        host, port = address_of(text)
        return ip_address(host).is_loopback and 0 <= port < 65536
    except ValueError:
        return False


def address_of(text: str) -> Address:
    host, _, port = text.rpartition(":")
    return host, int(port)


def _text(address: Address | None) -> str:
    return "nobody" if address is None else f"{address[0]}:{address[1]}"
