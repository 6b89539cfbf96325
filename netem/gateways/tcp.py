"""A TCP endpoint as a gateway: it listens for clients, each of which gets the whole stream, or calls a server.

    listen:  client --only_from, room?--> a peer                    connect: --> a peer --lost--> again, with back-off

A MAVLink ground station connects to `listen = "127.0.0.1:5760"`. What is read at once is one message (stream.py).
"""

from __future__ import annotations

import errno
import selectors
import socket
import time
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass
from os import strerror
from typing import ClassVar, Final

from netem.gateways import GONE, LOST, MISSING, REFUSED, SPEAKS, Datagrams, GatewaySettings, Tell, tell_nobody
from netem.gateways.addresses import Address, OnlyFrom, address_of, family_of, text_of, wrong_addresses
from netem.gateways.reconnection import Reconnection, wrong_times
from netem.gateways.stream import StreamGateway, StreamPeer
from netem.gateways.udp import MOST_TOLD, cannot_listen
from netem.wire.instants import NEVER_NS
from netem.wire.level import Level

ONE_OF: Final = "expected one of listen = \"127.0.0.1:5760\" and connect = \"127.0.0.1:5760\""
NO_CAN: Final = ("carries CAN frames, and a stream of bytes has no ends of frames; take kind = \"can\", or kind = "
                 "\"udp\" for the structs of SocketCAN")
ACCEPTED_AT_ONCE: Final = 20
CONNECT_WITHIN_NS: Final = 5_000_000_000


@dataclass(frozen=True)
class TcpSettings(GatewaySettings):
    """One of `listen` and `connect`, "host:port"."""

    listen: str | None = None           # beyond the loopback only with `only_from`; port 0: the system chooses
    connect: str | None = None
    only_from: tuple[str, ...] = ()     # addresses and networks of clients; (): all of the loopback
    most_peers: int = 8                 # clients at a time
    retry_ns: int = 500_000_000         # from a lost connection to the first attempt to connect again
    retry_longest_ns: int = 10_000_000_000
    most_bytes_per_s: int = 10_000_000  # of one peer

    def __post_init__(self) -> None:
        wrong = list(wrong_addresses(self.only_from, listen=self.listen))
        if (self.listen is None) is (self.connect is None):
            wrong.append(ONE_OF)
        if self.connect is not None:
            try:
                if address_of(self.connect)[1] == 0:
                    wrong.append(f"connect={self.connect}: expected a port from 1 to 65535")
            except ValueError as error:
                wrong.append(f"connect={self.connect}: {error}")
            if self.only_from:
                wrong.append(f"only_from={list(self.only_from)}: is about clients, and there are none with connect")
        wrong += [f"{key}={value}: expected at least 1" for key, value in (
            ("most_peers", self.most_peers), ("most_bytes_per_s", self.most_bytes_per_s)) if value < 1]
        wrong += wrong_times(self.retry_ns, self.retry_longest_ns)
        if wrong:
            raise ValueError("\n".join(wrong))

    def occupies(self) -> Collection[str]:
        return () if self.listen is None or address_of(self.listen)[1] == 0 else (f"the TCP address {self.listen}",)

    def refusal(self, *, carries_can_frames: bool, datagrams: Datagrams | None) -> str:
        return NO_CAN if carries_can_frames else ""


class SocketChannel:
    def __init__(self, connection: socket.socket) -> None:
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket = connection

    def fileno(self) -> int:
        return self._socket.fileno()

    def read(self, most: int) -> bytes | None:
        try:
            return self._socket.recv(most)
        except BlockingIOError:
            return None

    def write(self, data: bytes) -> int:
        try:
            return self._socket.send(data)
        except BlockingIOError:
            return 0

    def close(self) -> None:
        self._socket.close()


class TcpGateway(StreamGateway):
    Settings: ClassVar = TcpSettings
    settings: TcpSettings

    def __init__(self, name: str, medium: str, settings: TcpSettings, *, event: Tell = tell_nobody,
                 longest_bytes: int | None = None, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        """Listen, if it is to; raises OSError, with the address and a remedy, if that fails."""
        super().__init__(name, medium, settings, event=event, longest_bytes=longest_bytes, clock_ns=clock_ns)
        self.refused = 0
        self._only_from = OnlyFrom(settings.only_from)
        self._told: set[str] = set()                        # hosts refused with an event
        self._reconnection = Reconnection(settings.retry_ns, settings.retry_longest_ns)
        self._calling: socket.socket | None = None          # a connection that is being made
        self._lost_with = 0                                 # messages not sent when the connection was lost
        self._server: socket.socket | None = None
        self.listening: Address = ()
        if settings.listen is not None:
            self._server = self._listen(address_of(settings.listen))
            self.listening = self._server.getsockname()
            self._selector.register(self._server, selectors.EVENT_READ)

    def _listen(self, address: Address) -> socket.socket:
        server = socket.socket(family_of(address), socket.SOCK_STREAM)
        try:
            server.setblocking(False)
            server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if server.family == socket.AF_INET6:
                server.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            server.bind(address)
            server.listen()
        except OSError as error:
            server.close()
            self.close()
            raise cannot_listen(self.name, address, error) from error
        return server

    # --- as a gateway to streams

    def next_ns(self) -> int:
        return NEVER_NS if self._server is not None else self._reconnection.due_ns

    def attend(self, now_ns: int) -> None:
        if self._server is not None:
            self._accept()
        elif self._calling is not None:
            self._look_whether_connected(now_ns)
        elif self._reconnection.due_ns <= now_ns:
            self._call(now_ns)

    def lost(self, peer: StreamPeer, why: str) -> None:
        if self._server is not None:
            self.tell(GONE, f"speaks no longer with {peer.name}: {why}", Level.INFO)
            return
        self.tell(LOST, f"has lost {peer.name}: {why}; {self._reconnection.in_words()}")
        self._lost_with = self.messages_unsent
        self._reconnection.failed(self._clock_ns())

    def counters(self) -> dict[str, int]:
        return super().counters() | {"connections refused": self.refused}

    def alone(self) -> str:
        if self.connections or self._server is None:
            return ""
        return (f"no program outside the run connected to {text_of(self.listening)}, so the gateway sent no frame: "
                "let one connect there")

    def close(self) -> None:
        super().close()
        for each in (self._server, self._calling):
            if each is not None:
                each.close()

    # --- listen

    def _accept(self) -> None:
        assert self._server is not None
        for _ in range(ACCEPTED_AT_ONCE):
            try:
                connection, address = self._server.accept()
            except BlockingIOError:
                return
            except OSError:                 # it has been given up already
                continue
            why = self._why_not(address)
            if why:
                self.refused += 1
                connection.close()
                if address[0] not in self._told and len(self._told) < MOST_TOLD:
                    self._told.add(address[0])
                    self.tell(REFUSED, f"closes the connection of {text_of(address)}: {why}")
                continue
            self._told.discard(address[0])
            self.add(text_of(address), SocketChannel(connection), self.settings.most_bytes_per_s)
            self.tell(SPEAKS, f"speaks with {text_of(address)}", Level.INFO)

    def _why_not(self, address: Address) -> str:
        if not self._only_from.admits(address[0]):
            return f"it is not among only_from = {list(self.settings.only_from)}"
        if len(self._peers) >= self.settings.most_peers:
            return (f"it speaks with {', '.join(peer.name for peer in self._peers)} and takes no more than "
                    f"{self.settings.most_peers}; raise most_peers, or give it a gateway of its own")
        return ""

    # --- connect

    def _call(self, now_ns: int) -> None:
        assert self.settings.connect is not None
        address = address_of(self.settings.connect)
        calling = socket.socket(family_of(address), socket.SOCK_STREAM)
        calling.setblocking(False)
        code = calling.connect_ex(address)
        if code not in (0, errno.EINPROGRESS):
            calling.close()
            self._failed(strerror(code), now_ns)
            return
        self._calling = calling
        self._selector.register(calling, selectors.EVENT_WRITE)
        self._reconnection.under_way(now_ns + CONNECT_WITHIN_NS)

    def _look_whether_connected(self, now_ns: int) -> None:
        calling, server = self._calling, self.settings.connect
        assert calling is not None
        assert server is not None
        if not any(key.fileobj is calling for key, _ in self._selector.select(0)):
            if self._reconnection.due_ns > now_ns:
                return
            code = errno.ETIMEDOUT
        else:
            code = calling.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        self._selector.unregister(calling)
        self._calling = None
        with suppress(OSError):
            if code == 0 and calling.getsockname() == calling.getpeername():
                code = errno.ECONNREFUSED           # a call to a free port of this machine can reach itself
        if code:
            calling.close()
            self._failed(strerror(code), now_ns)
            return
        again = f" again; {self.messages_unsent - self._lost_with} frames were lost meanwhile" if (
            self.connections or self._reconnection.told) else ""
        self._reconnection.succeeded()
        self.add(server, SocketChannel(calling), self.settings.most_bytes_per_s)
        self.tell(SPEAKS, f"speaks with {server}{again}", Level.INFO)

    def _failed(self, why: str, now_ns: int) -> None:
        if self._reconnection.failed(now_ns):
            self.tell(MISSING, f"cannot connect to {self.settings.connect}: {why}; start the program that listens "
                      f"there, or correct connect; {self._reconnection.in_words()}")
