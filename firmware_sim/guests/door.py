"""The sockets by which a node speaks with its guest, on the loopback; every wait for the guest has a time-out.

In virtual time a program must not communicate outside (`netem/node/outside_guard.py`). A guest is the exception, since
the node holds its time: while one of the two computes, the other waits. So the calls here are excused, and only these.
"""

from __future__ import annotations

import select
import socket
import time
from contextlib import suppress
from ipaddress import ip_address

from netem.node.outside_guard import excused

LARGEST_DATAGRAM = 65_535
MOST_DATAGRAMS = 100            # taken from a telemetry socket at once; others wait in the system's buffer

Address = tuple[str, int]


class GuestFailure(Exception):
    """The guest did not come, does not answer, or left."""


def loopback_address(key: str, text: str) -> Address:
    """Return (host, port) of "127.0.0.1:port"; raises ValueError, which names `key`, for anything else."""
    host, _, port = text.rpartition(":")
    try:
        if ip_address(host).version == 4 and ip_address(host).is_loopback and 1 <= int(port) < 65_536:
            return host, int(port)
    except ValueError:
        pass
    raise ValueError(f'{key}={text}: expected "127.0.0.1:port", an IPv4 address of the loopback and a port from 1 to '
                     "65535")


def seconds_left(until_s: float) -> float:
    """Return the time until `until_s` of the monotonic clock [s], 0 if it has passed."""
    return max(0.0, until_s - time.monotonic())


class Caller:
    """A guest that connects by TCP to `listen`."""

    def __init__(self, name: str, listen: Address) -> None:
        """Listen; raises GuestFailure if the address is taken."""
        self._name, self._listen = name, listen
        self._connection: socket.socket | None = None
        with excused():
            try:
                self._listener = socket.create_server(listen, backlog=1)
            except OSError as error:
                raise GuestFailure(f"{name}: cannot listen on {_text(listen)}: {error.strerror}; end the program that "
                                   "does, or choose another port by `listen`") from None

    def meet(self, within_s: float) -> None:
        """Wait until the guest connects."""
        if not select.select([self._listener], [], [], within_s)[0]:
            raise GuestFailure(f"{self._name}: no autopilot has connected to {_text(self._listen)} within "
                               f"{within_s:g} s; start it, or give it more time by `connect_within_s`")
        self._connection, _ = self._listener.accept()
        self._listener.close()          # another caller is refused by the system
        self._connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data: bytes, within_s: float) -> None:
        assert self._connection is not None
        self._connection.settimeout(within_s)
        try:
            self._connection.sendall(data)
        except TimeoutError:
            raise GuestFailure(f"{self._name}: the autopilot has read nothing for {within_s:g} s") from None
        except OSError:
            raise self._left() from None

    def receive(self, until_s: float) -> bytes:
        """Return bytes that have arrived; b"" if none arrives before `until_s` of the monotonic clock."""
        assert self._connection is not None
        if not select.select([self._connection], [], [], seconds_left(until_s))[0]:
            return b""
        try:
            data = self._connection.recv(LARGEST_DATAGRAM)
        except OSError:
            data = b""
        if not data:
            raise self._left()
        return data

    def close(self) -> None:
        self._listener.close()
        if self._connection is not None:
            self._connection.close()

    def _left(self) -> GuestFailure:
        return GuestFailure(f"{self._name}: the autopilot has closed its connection; see its own output for the "
                            "reason, and start it anew for the next run")


class Datagrams:
    """A UDP socket on `listen` whose peer is whoever spoke last."""

    def __init__(self, name: str, listen: Address, key: str) -> None:
        """Bind; raises GuestFailure, which names the setting `key`, if the address is taken."""
        self.peer: Address | None = None
        with excused():
            self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._socket.setblocking(False)
            try:
                self._socket.bind(listen)
            except OSError as error:
                self._socket.close()
                raise GuestFailure(f"{name}: cannot listen on {_text(listen)}: {error.strerror}; end the program that "
                                   f"does, or choose another port by `{key}`") from None

    def receive(self, until_s: float = 0.0) -> bytes | None:
        """Return a datagram; None if none arrives before `until_s` of the monotonic clock, at once by default."""
        while True:
            try:
                data, self.peer = self._socket.recvfrom(LARGEST_DATAGRAM)
                return data
            except BlockingIOError:
                if not select.select([self._socket], [], [], seconds_left(until_s))[0]:
                    return None
            except ConnectionError:         # ICMP: nothing listens at the peer's port
                continue

    def receive_all(self) -> list[bytes]:
        """Return the datagrams that have arrived, at most MOST_DATAGRAMS, oldest first."""
        found: list[bytes] = []
        while len(found) < MOST_DATAGRAMS and (data := self.receive()) is not None:
            found.append(data)
        return found

    def send(self, data: bytes) -> bool:
        """Send to the peer; False if there is none yet, or the system refuses."""
        if self.peer is not None:
            with suppress(OSError), excused():
                self._socket.sendto(data, self.peer)
                return True
        return False

    def close(self) -> None:
        self._socket.close()


def _text(address: Address) -> str:
    return f"{address[0]}:{address[1]}"
