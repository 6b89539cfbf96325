"""A UDP socket of a blocking program (IPv4), whose datagrams are frames of a medium.

Calls, errors and defaults are those of Linux's `udp(7)` and `socket(7)`. A datagram takes its bytes and
`OVERHEAD_BYTES` of the receive buffer (SO_RCVBUF), about what Linux takes; one without room is dropped and counted.

Sending never waits. Options that only matter to a real network (SO_PRIORITY, IP_TOS, IP_TTL) are kept without effect.
"""

from __future__ import annotations

import errno
import os
import socket
from collections import deque
from collections.abc import Callable
from ipaddress import IPv4Address
from typing import Any, Final

from firmware_sim.blocking.here import this_program
from firmware_sim.sockets.interface import EVERYWHERE
from firmware_sim.sockets.stack import ANY, LAST_PORT, Address, stack_of
from firmware_sim.sockets.udp_packet import LONGEST_PAYLOAD, UdpPacket
from firmware_sim.sockets.virtual_files import VirtualSocket, refuse

OVERHEAD_BYTES: Final = 832             # what Linux 6 takes for an empty datagram
KEPT_OPTIONS: Final = {(socket.SOL_SOCKET, getattr(socket, name)) for name in (
    "SO_REUSEADDR", "SO_REUSEPORT", "SO_BROADCAST", "SO_RCVBUF", "SO_SNDBUF", "SO_PRIORITY", "SO_KEEPALIVE",
    "SO_DONTROUTE", "SO_ERROR", "SO_TYPE", "SO_DOMAIN", "SO_PROTOCOL") if hasattr(socket, name)} | {
    (socket.IPPROTO_IP, socket.IP_TOS), (socket.IPPROTO_IP, socket.IP_TTL)}
NAMES_OF_OPTIONS: Final = {value: name for name, value in reversed(list(vars(socket).items()))
                           if name.startswith(("IP_", "SO_")) and isinstance(value, int)}


class UdpSocket(VirtualSocket):
    what = "a UDP socket"

    def __init__(self, family: int = -1, type: int = -1, proto: int = -1, fileno: int | None = None) -> None:
        """Open a socket for the calling thread's program; the arguments are those of `socket.socket`."""
        self.stack = stack_of(this_program())
        self.address = ANY
        self.port = 0                           # 0: not bound
        self.peer: Address | None = None        # of `connect`
        self.sent_to: Address | None = None     # destination of the last `sendto`
        self._datagrams: deque[tuple[bytes, Address]] = deque()
        self._queued_bytes = 0
        self._shut = False                      # no more receiving, after `shutdown`
        super().__init__(self.stack.program, socket.AF_INET, type, max(proto, 0))

    # --- what the stack asks

    def readable(self) -> bool:
        return bool(self._datagrams) or self._shut

    def takes(self, packet: UdpPacket, source: Address) -> bool:
        """Return whether a datagram is for this socket."""
        return (self.port == packet.destination_port and self.address in (ANY, packet.destination)
                and self.peer in (None, source))

    def takes_bare(self) -> bool:
        """Return whether frames of the bare medium are for this socket: unless it keeps to an IP network."""
        return not any(self.address == one.address for one in self.stack.interfaces) and (
            self.peer is None or self.stack.goes_bare(IPv4Address(self.peer[0])))

    def receive(self, data: bytes, source: Address) -> bool:
        """Put a datagram into the buffer; returns False if there is no room for it."""
        size = len(data) + OVERHEAD_BYTES
        if self._queued_bytes and self._queued_bytes + size > self.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF):
            return False
        self._datagrams.append((data, source))
        self._queued_bytes += size
        self.note_readable()
        return True

    def shares_port_with(self, other: UdpSocket) -> bool:
        return any(all(one.getsockopt(socket.SOL_SOCKET, option) for one in (self, other))
                   for option in (socket.SO_REUSEADDR, socket.SO_REUSEPORT))

    # --- addresses

    def bind(self, address: Any) -> None:
        self.check_here()
        host, port = _checked(address, "bind")
        found = self.stack.own_address(host)
        if self.port:
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        self.stack.bind(self, found, port)

    def connect(self, address: Any) -> None:
        self.check_here()
        host, port = _checked(address, "connect")
        destination = self.stack.resolve(host)
        if destination == EVERYWHERE and not self.getsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        route = self.stack.route(destination, self.address)
        self._bind_if_unbound()
        if self.address == ANY:
            self.address = route.source
        if destination == ANY:
            destination = route.source
        self.peer = str(destination), port

    def connect_ex(self, address: Any) -> int:
        try:
            self.connect(address)
        except OSError as error:
            return error.errno or errno.EINVAL
        return 0

    def getsockname(self) -> Address:
        self.check_here()
        return str(self.address), self.port

    def getpeername(self) -> Address:
        self.check_here()
        if self.peer is None:
            raise OSError(errno.ENOTCONN, os.strerror(errno.ENOTCONN))
        return self.peer

    def _bind_if_unbound(self) -> None:
        if not self.port:
            self.stack.bind(self, self.address, 0)

    # --- sending

    def send(self, data: Any, flags: int = 0) -> int:
        if self.peer is None:
            self.check_here()
            self._bind_if_unbound()
            raise OSError(errno.EDESTADDRREQ, os.strerror(errno.EDESTADDRREQ))
        return self._send(data, self.peer)

    def sendall(self, data: Any, flags: int = 0) -> None:
        self.send(data, flags)

    def sendto(self, data: Any, *flags_and_address: Any) -> int:
        if len(flags_and_address) not in (1, 2):
            raise TypeError(f"sendto() takes 2 or 3 arguments ({1 + len(flags_and_address)} given)")
        return self._send(data, _checked(flags_and_address[-1], "sendto"))

    def _send(self, data: Any, to: Address) -> int:
        self.check_here()
        found = bytes(memoryview(data))
        self._bind_if_unbound()             # Linux does so before its checks
        if len(found) > LONGEST_PAYLOAD:
            raise OSError(errno.EMSGSIZE, os.strerror(errno.EMSGSIZE))
        if to[1] == 0:
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        destination = self.stack.resolve(to[0])
        if self._is_broadcast(destination) and not self.getsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        if destination != EVERYWHERE:           # an answer to a broadcast comes from one host
            self.sent_to = str(destination), to[1]
        self.stack.send(self, found, destination, to[1])
        self.program.note_call()
        return len(found)

    def _is_broadcast(self, destination: IPv4Address) -> bool:
        return destination == EVERYWHERE or any(destination == one.network.broadcast_address
                                                for one in self.stack.interfaces)

    # --- receiving

    def recvfrom(self, bufsize: int, flags: int = 0) -> tuple[bytes, Any]:
        if bufsize < 0:
            raise ValueError("negative buffersize in recvfrom")
        data, source, _length = self._take(bufsize, flags)
        return data, source

    def recv(self, bufsize: int, flags: int = 0) -> bytes:
        if bufsize < 0:
            raise ValueError("negative buffersize in recv")
        return self._take(bufsize, flags)[0]

    def recvfrom_into(self, buffer: Any, nbytes: int = 0, flags: int = 0) -> tuple[int, Any]:
        view = memoryview(buffer).cast("B")
        data, source, length = self._take(nbytes or len(view), flags)
        view[:len(data)] = data
        return length, source

    def recv_into(self, buffer: Any, nbytes: int = 0, flags: int = 0) -> int:
        return self.recvfrom_into(buffer, nbytes, flags)[0]

    def _take(self, size: int, flags: int) -> tuple[bytes, Address | None, int]:
        """Return at most `size` bytes of the oldest datagram, where it comes from, and the length to report."""
        self.await_readable(flags)
        if not self._datagrams:
            return b"", None, 0                 # after `shutdown`
        data, source = self._datagrams[0]
        if not flags & socket.MSG_PEEK:
            self._datagrams.popleft()
            self._queued_bytes -= len(data) + OVERHEAD_BYTES
        return data[:size], source, len(data) if flags & socket.MSG_TRUNC else min(size, len(data))

    def shutdown(self, how: int) -> None:
        self.check_here()
        if self.peer is None:
            raise OSError(errno.ENOTCONN, os.strerror(errno.ENOTCONN))
        if how in (socket.SHUT_RD, socket.SHUT_RDWR):
            self._shut = True
            self.note_readable()

    # --- options

    def setsockopt(self, level: int, option: int, *value: Any) -> None:
        self._check_option(level, option)
        super().setsockopt(level, option, *value)

    def getsockopt(self, level: int, option: int, *size: Any) -> Any:
        self._check_option(level, option)
        return super().getsockopt(level, option, *size)

    def _check_option(self, level: int, option: int) -> None:
        if (level, option) in KEPT_OPTIONS:
            return
        name = NAMES_OF_OPTIONS.get(option, str(option)) if level in (socket.SOL_SOCKET, socket.IPPROTO_IP) \
            else f"{level}, {option}"
        remedy = "there is no multicast; send to the broadcast address, or to each node" \
            if name.startswith(("IP_ADD", "IP_DROP", "IP_MULTI")) else \
            "use settimeout" if name.endswith("TIMEO") else "leave the option out"
        refuse(f"the socket option {name}", remedy)

    def leave(self) -> None:
        self.stack.release(self)


def _checked(address: Any, caller: str) -> Address:
    """Return (host, port); raises what Python's own sockets raise for what is none."""
    if not isinstance(address, tuple):
        raise TypeError(f"{caller}(): AF_INET address must be tuple, not {type(address).__name__}")
    if len(address) != 2:
        raise TypeError(f"{caller}(): AF_INET address must be a pair (host, port)")
    host, port = address
    if isinstance(host, bytes | bytearray):
        host = host.decode()
    if not isinstance(host, str):
        raise TypeError(f"{caller}(): host must be text, not {type(host).__name__}")
    number: Callable[[], int] = port.__index__
    if not 0 <= number() <= LAST_PORT:
        raise OverflowError(f"{caller}(): port must be 0-65535.")
    return host, number()
