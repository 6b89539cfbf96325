"""A UDP endpoint as a gateway: each datagram is one message, and each peer that spoke gets the whole stream.

    datagram of a known peer --> medium         frame from the medium --> a datagram to each peer
    of a new address --only_from, room?--> a peer, which gets the stream from now on

A datagram enters the medium at the instant at which the system took it in, of which the system keeps a time stamp
(SO_TIMESTAMPNS, socket(7)), and not when the emulator, which may be asleep or busy, comes to read it.

So a map and a script fly one vehicle. The configured `peer` gets the stream from the start and is never forgotten; any
other is forgotten after `forget_after_ns` without a datagram from it. Peers come, are refused and are forgotten with an
event each. A peer that sends more than `most_per_s` is told once, and what is beyond is dropped and counted.

Not modelled: messages longer than a datagram.
"""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Callable, Collection, Iterable
from contextlib import suppress
from dataclasses import dataclass
from typing import ClassVar, Final

from netem.gateways import GONE, REFUSED, SPEAKS, Arrival, Gateway, GatewaySettings, Tell, tell_nobody
from netem.gateways.addresses import Address, OnlyFrom, address_of, family_of, text_of, wrong_addresses
from netem.gateways.allowance import Allowance
from netem.wire.instants import NEVER_NS
from netem.wire.level import Level

LARGEST_DATAGRAM: Final = 65_535
READS_PER_MESSAGE: Final = 4        # datagrams read for each message wanted, as some may be refused
STAMPED: Final = getattr(socket, "SO_TIMESTAMPNS", 35)      # since Python 3.14; asm-generic/socket.h
_STAMP: Final = struct.Struct("@ll")                        # struct timespec, by CLOCK_REALTIME
_STAMP_SPACE: Final = socket.CMSG_SPACE(_STAMP.size)
MOST_TOLD: Final = 20               # refused addresses with an event each; further ones are only counted


@dataclass(frozen=True)
class UdpSettings(GatewaySettings):
    """Addresses are "host:port"; beyond the loopback only with `only_from`."""

    listen: str = "127.0.0.1:0"         # port 0: the system chooses
    peer: str | None = None             # address that gets the stream before it speaks
    only_from: tuple[str, ...] = ()     # addresses and networks that may speak; (): all of the loopback
    most_peers: int = 8
    forget_after_ns: int = 60_000_000_000   # silence after which a peer is forgotten; 0: never
    most_per_s: int = 10_000            # datagrams of one peer; those beyond are dropped

    def __post_init__(self) -> None:
        wrong = list(wrong_addresses(self.only_from, listen=self.listen, peer=self.peer))
        wrong += [f"{key}={value}: expected at least {least}" for key, value, least in (
            ("most_peers", self.most_peers, 1), ("forget_after_ns", self.forget_after_ns, 0),
            ("most_per_s", self.most_per_s, 1)) if value < least]
        if wrong:
            raise ValueError("\n".join(wrong))

    def occupies(self) -> Collection[str]:
        return () if address_of(self.listen)[1] == 0 else (f"the UDP address {self.listen}",)


class Peer:
    def __init__(self, spoke_ns: int | None, allowance: Allowance) -> None:
        self.spoke_ns = spoke_ns        # time of its last datagram; None: the configured one, which may be silent
        self.allowance = allowance


class UdpGateway(Gateway):
    """A gateway to UDP peers.

    Invariants:
    - `received + refused + flooded` is the number of datagrams read;
    - `sent + unsent` is the number of (frame, peer), where a frame without any peer counts once.
    """

    Settings: ClassVar = UdpSettings
    settings: UdpSettings

    def __init__(self, name: str, medium: str, settings: UdpSettings, *, event: Tell = tell_nobody,
                 longest_bytes: int | None = None, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        """Bind the socket; raises OSError, with the address and a remedy, if that fails."""
        super().__init__(name, medium, settings, event=event, longest_bytes=longest_bytes, clock_ns=clock_ns)
        listen = address_of(settings.listen)
        self.received = self.refused = self.flooded = self.sent = self.unsent = 0
        self._only_from = OnlyFrom(settings.only_from)
        self._told: set[Address] = set()            # refused addresses with an event
        self._peers: dict[Address, Peer] = {}
        self._constant = None if settings.peer is None else address_of(settings.peer)
        if self._constant is not None:
            self._peers[self._constant] = Peer(None, self._allowance(clock_ns()))
        self._socket = socket.socket(family_of(listen), socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            if self._socket.family == socket.AF_INET6:
                self._socket.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            with suppress(OSError):         # without time stamps a datagram arrives when it is read
                self._socket.setsockopt(socket.SOL_SOCKET, STAMPED, 1)
            self._socket.bind(listen)
        except OSError as error:
            self._socket.close()
            raise cannot_listen(name, listen, error) from error
        self.listening: Address = self._socket.getsockname()

    @property
    def peers(self) -> Collection[Address]:
        """The addresses that get the stream."""
        return self._peers.keys()

    def fileno(self) -> int:
        return self._socket.fileno()

    def due_ns(self) -> int:
        """See `Gateway`: when the peer that has been silent for the longest time is to be forgotten."""
        after_ns = self.settings.forget_after_ns
        if not after_ns or not self._peers:
            return NEVER_NS
        return min((peer.spoke_ns + after_ns for peer in self._peers.values() if peer.spoke_ns is not None),
                   default=NEVER_NS)

    def receive(self, most: int) -> list[bytes]:
        return [data for _, data in self.arrivals(most)]

    def arrivals(self, most: int) -> list[Arrival]:
        found: list[Arrival] = []
        now_ns = self._clock_ns()
        to_clock_ns = now_ns - time.time_ns()       # from the clock of the stamps; the system may set that clock
        self._forget(now_ns)
        for _ in range(READS_PER_MESSAGE * most):
            if len(found) == most:
                break
            try:
                data, notes, _, sender = self._socket.recvmsg(LARGEST_DATAGRAM, _STAMP_SPACE)
            except BlockingIOError:
                break
            except OSError:                 # ICMP: nothing listens at a peer's port
                continue
            if self._admit(sender, now_ns):
                found.append(Arrival(min(now_ns, _stamp_ns(notes, now_ns - to_clock_ns) + to_clock_ns), data))
        return found

    def send(self, data: bytes) -> None:
        if not self._peers:
            self.unsent += 1
        for address in self._peers:
            with suppress(OSError):
                self._socket.sendto(data, address)
                self.sent += 1
                continue
            self.unsent += 1

    def counters(self) -> dict[str, int]:
        return {"datagrams received": self.received, "datagrams refused": self.refused,
                "datagrams beyond the rate": self.flooded, "datagrams sent": self.sent,
                "datagrams not sent": self.unsent}

    def alone(self) -> str:
        if self.received or self._constant is not None:
            return ""
        return (f"no program outside the run sent a datagram to {text_of(self.listening)}, so the gateway sent no "
                "frame: let one send there first, or give the address of one as `peer`")

    def close(self) -> None:
        self._socket.close()

    def _admit(self, sender: Address, now_ns: int) -> bool:
        """Return whether a datagram of `sender` is taken; make the sender a peer if it may be one."""
        peer = self._peers.get(sender)
        if peer is None:
            why = self._why_not(sender)
            if why:
                self._refuse(sender, why)
                return False
            peer = self._peers[sender] = Peer(now_ns, self._allowance(now_ns))
            self._told.discard(sender)
            self.tell(SPEAKS, f"speaks with {text_of(sender)}", Level.INFO)
        elif sender != self._constant:
            peer.spoke_ns = now_ns
        if peer.allowance.take(now_ns):
            self.received += 1
            return True
        self.flooded += 1
        self.tell_flood(peer.allowance, f"{text_of(sender)} sends more than {self.settings.most_per_s} datagrams a "
                        "second; those beyond are dropped and counted; raise most_per_s if that is what it should send")
        return False

    def _why_not(self, sender: Address) -> str:
        if not self._only_from.admits(sender[0]):
            return f"it is not among only_from = {list(self.settings.only_from)}"
        if len(self._peers) >= self.settings.most_peers:
            return (f"it speaks with {', '.join(map(text_of, self._peers))} and takes no more than "
                    f"{self.settings.most_peers}; raise most_peers, or give it a gateway of its own")
        return ""

    def _refuse(self, sender: Address, why: str) -> None:
        self.refused += 1
        if sender not in self._told and len(self._told) < MOST_TOLD:
            self._told.add(sender)
            self.tell(REFUSED, f"drops the datagrams of {text_of(sender)}: {why}")

    def _forget(self, now_ns: int) -> None:
        while self.due_ns() <= now_ns:
            address, peer = min(self._peers.items(), key=lambda item: (
                NEVER_NS if item[1].spoke_ns is None else item[1].spoke_ns))
            assert peer.spoke_ns is not None
            del self._peers[address]
            silent_s = self.settings.forget_after_ns * 1e-9
            self.tell(GONE, f"forgets {text_of(address)}, which has been silent for {silent_s:g} s; it takes part "
                      "again as soon as it speaks", Level.INFO)

    def _allowance(self, now_ns: int) -> Allowance:
        return Allowance(self.settings.most_per_s, now_ns)


def _stamp_ns(notes: Iterable[tuple[int, int, bytes]], otherwise_ns: int) -> int:
    """Return the time stamp in the ancillary data of a datagram [ns], `otherwise_ns` if there is none."""
    for level, kind, content in notes:
        if level == socket.SOL_SOCKET and kind == STAMPED and len(content) == _STAMP.size:
            seconds, nanoseconds = _STAMP.unpack(content)
            return int(seconds * 1_000_000_000 + nanoseconds)
    return otherwise_ns


def cannot_listen(name: str, address: Address, error: OSError) -> OSError:
    """Return the error of a gateway whose address cannot be had."""
    return OSError(f"gateways.{name}: cannot listen on {text_of(address)}: {error.strerror}; end the program or run "
                   "that has it, or listen on another port, 0 for one that the system chooses")
