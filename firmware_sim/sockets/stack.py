"""The network stack of one blocking program: local ports, routes, and delivery of datagrams to its sockets.

    socket.sendto --> route: by the destination's network --> IPv4 packet, or bare frame --> port of the node
    port of the node --> packet, checked --> sockets that it is for --> their receive buffers --> socket.recvfrom

- A destination within an IP network of the node goes there, to the node of that address or to all (255.255.255.255 or
  the highest address of the network; a sender gets its own broadcast too, as on Linux). 127.0.0.0/8 and the node's own
  addresses stay inside the program.
- Everything else goes to the bare medium, if the node has one: a frame is the datagram alone. What arrives there goes
  to every bound socket, and seems to come from where that socket sends to.

Counters of the node, by medium: `malformed` (no UDP in IPv4, a wrong checksum), `other_address` (for another node),
`no_host` (sent to an address that nobody has), `no_socket` (no socket at that port), `rx_dropped` (buffer full).

Not modelled: ARP, ICMP (so no ConnectionRefusedError), routing over several hops, multicast, TCP.
"""

from __future__ import annotations

import errno
import os
import socket
from functools import partial
from ipaddress import IPv4Address, IPv4Network
from typing import Any, Final, NamedTuple, Protocol

from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.sockets.interface import EVERYWHERE, LOOPBACK, Interface
from firmware_sim.sockets.udp_packet import UdpPacket, pack_ip, pack_udp, unpack_ip, unpack_udp
from firmware_sim.sockets.virtual_files import refuse
from netem.media.packet_network.datagram import EVERYONE, Datagram, pack, unpack

Address = tuple[str, int]

ANY: Final = IPv4Address(0)
LOCALHOST: Final = IPv4Address("127.0.0.1")
NAMES: Final = {"": ANY, "localhost": LOCALHOST, "<broadcast>": EVERYWHERE}
FIRST_FREE_PORT: Final = 32_768         # first of Linux's range for ports that the system chooses
LAST_PORT: Final = 65_535
NOBODY: Final = ("127.0.0.1", 1)        # where a bare datagram comes from, for a socket that has not sent any
COUNTERS: Final = ("malformed", "no_socket", "rx_dropped")
IP_COUNTERS: Final = ("no_host", "other_address")


class Bound(Protocol):
    """What the stack asks of a socket (`udp_socket.py`), and sets when it binds it."""

    address: IPv4Address
    port: int
    peer: Address | None
    sent_to: Address | None

    def takes(self, packet: UdpPacket, source: Address) -> bool: ...

    def takes_bare(self) -> bool: ...

    def receive(self, data: bytes, source: Address) -> bool: ...

    def shares_port_with(self, other: Any) -> bool: ...


class Route(NamedTuple):
    """The way to a destination: an interface, None within the program; the sender's address."""

    interface: IpInterface | None
    source: IPv4Address
    everyone: bool = False


class IpInterface:
    def __init__(self, given: Interface, node: str) -> None:
        self.medium = given.medium
        self.addressed = given.addressed
        self.network = IPv4Network(given.network)
        self.address = IPv4Address(given.hosts[node])
        self.hosts = {IPv4Address(address): name for name, address in given.hosts.items()}
        self.sent = 0


class Stack:
    """Made with the first socket of a program; frames that arrive before are dropped, as before a port is opened."""

    def __init__(self, program: BlockingProgram) -> None:
        self.program = program
        self.sockets: list[Bound] = []              # those with a local port, in the order of binding
        self.bare: str | None = None                    # medium of bare datagrams
        self.interfaces: list[IpInterface] = []
        self.hosts: dict[str, IPv4Address] = {}
        self._next_port = FIRST_FREE_PORT
        node = program.node
        for given in program.interfaces:
            if given.network:
                interface = IpInterface(given, node.name)
                self.interfaces.append(interface)
                for name, address in given.hosts.items():
                    self.hosts.setdefault(name, IPv4Address(address))
                node.ports[given.medium].on_receive = partial(self._receive_ip, interface)
            else:
                self.bare = given.medium
                node.ports[given.medium].on_receive = self._receive_bare
            for what in COUNTERS + (IP_COUNTERS if given.network else ()):
                node.count(f"{given.medium}.{what}", 0)
        if self.interfaces:
            self.hosts[node.name] = self.interfaces[0].address

    # --- addresses

    def resolve(self, host: str) -> IPv4Address:
        """Return the address of a host name or number; socket.gaierror, or the guard's refusal, for an unknown name."""
        if (address := NAMES.get(host)) is not None or (address := self.hosts.get(host)) is not None:
            return address
        try:
            return IPv4Address(socket.inet_aton(host))
        except OSError:
            return IPv4Address(socket.gethostbyname(host))

    def name_of(self, address: IPv4Address) -> str | None:
        return next((interface.hosts[address] for interface in self.interfaces if address in interface.hosts), None)

    def own_address(self, host: str) -> IPv4Address:
        """Return the address that a socket is bound to by the name `host`; OSError if the node does not have it."""
        address = self.resolve(host)
        if address in LOOPBACK or address in (ANY, EVERYWHERE, *(one.address for one in self.interfaces)):
            return address
        raise OSError(errno.EADDRNOTAVAIL, f"{os.strerror(errno.EADDRNOTAVAIL)}: {address} is no address of node "
                                           f"{self.program.node.name} ({self._networks()})")

    def route(self, destination: IPv4Address, bound: IPv4Address) -> Route:
        """Return the way to `destination` for a socket bound to the address `bound`; OSError if there is none."""
        if destination.is_multicast:
            refuse(f"multicast ({destination})", "send to the broadcast address, or to each node")
        if destination == ANY:
            destination = LOCALHOST
        for interface in self.interfaces:
            if destination == interface.address:
                return Route(None, destination)
            if destination in interface.network:
                return Route(interface, interface.address, destination == interface.network.broadcast_address)
        if destination == EVERYWHERE and self.interfaces:
            chosen = next((one for one in self.interfaces if one.address == bound), self.interfaces[0])
            return Route(chosen, chosen.address, everyone=True)
        if self.bare is not None:
            return Route(None, LOCALHOST)
        if destination in LOOPBACK:
            return Route(None, LOCALHOST if bound == ANY else bound)
        raise OSError(errno.ENETUNREACH, f"{os.strerror(errno.ENETUNREACH)}: {destination} is in no network of node "
                                         f"{self.program.node.name} ({self._networks()})")

    def goes_bare(self, destination: IPv4Address) -> bool:
        """Return whether a datagram to `destination` is sent as a frame of the bare medium."""
        return self.bare is not None and not any(destination in interface.network for interface in self.interfaces) \
            and not (destination == EVERYWHERE and self.interfaces)

    # --- ports

    def bind(self, one: Bound, address: IPv4Address, port: int) -> None:
        """Give a socket its local address; 0 as port chooses one. OSError if another socket has it."""
        if port == 0:
            port = self._free_port()
        for other in self.sockets:
            meet = ANY in (address, other.address) or address == other.address
            if other.port == port and meet and not one.shares_port_with(other):
                raise OSError(errno.EADDRINUSE, os.strerror(errno.EADDRINUSE))
        one.address, one.port = address, port
        self.sockets.append(one)

    def release(self, one: Bound) -> None:
        if one in self.sockets:
            self.sockets.remove(one)

    def _free_port(self) -> int:
        taken = {one.port for one in self.sockets}
        for _ in range(FIRST_FREE_PORT, LAST_PORT + 1):
            port, self._next_port = self._next_port, self._next_port + 1
            if self._next_port > LAST_PORT:
                self._next_port = FIRST_FREE_PORT
            if port not in taken:
                return port
        raise OSError(errno.EADDRINUSE, os.strerror(errno.EADDRINUSE))

    # --- sending

    def send(self, one: Bound, data: bytes, destination: IPv4Address, port: int) -> None:
        if self.goes_bare(destination):
            assert self.bare is not None
            self.program.send(self.bare, data)
            return
        route = self.route(destination, one.address)
        source = route.source if one.address in (ANY, EVERYWHERE) else one.address
        if destination == ANY:
            destination = LOCALHOST
        packet = UdpPacket(source, one.port, destination, port, data)
        interface = route.interface
        if interface is None:
            self._deliver(packet, None)
            return
        if not route.everyone and destination not in interface.hosts:
            self.program.node.count(f"{interface.medium}.no_host")
            return
        if interface.addressed:
            to = EVERYONE if route.everyone else interface.hosts[destination]
            self.program.send(interface.medium, pack(Datagram(to, pack_udp(packet))))
        else:
            self.program.send(interface.medium, pack_ip(packet, interface.sent))
            interface.sent += 1
        if route.everyone:
            self._deliver(packet, None)

    # --- receiving, in the node's thread

    def _receive_bare(self, data: bytes) -> None:
        assert self.bare is not None
        fits = [one for one in self.sockets if one.takes_bare()]
        for one in fits:
            if not one.receive(data, one.peer or one.sent_to or NOBODY):
                self.program.node.count(f"{self.bare}.rx_dropped")
        if not fits:
            self.program.node.count(f"{self.bare}.no_socket")
        self.program.promise()

    def _receive_ip(self, interface: IpInterface, data: bytes) -> None:
        packet = self._read_addressed(interface, data) if interface.addressed else unpack_ip(data)
        if packet is None:
            self.program.node.count(f"{interface.medium}.malformed")
        elif packet.destination in (interface.address, interface.network.broadcast_address, EVERYWHERE):
            self._deliver(packet, interface)
        else:
            self.program.node.count(f"{interface.medium}.other_address")
        self.program.promise()

    def _read_addressed(self, interface: IpInterface, data: bytes) -> UdpPacket | None:
        datagram = unpack(data)
        addresses = {name: address for address, name in interface.hosts.items()}
        if datagram is None or datagram.source not in addresses:
            return None
        source = addresses[datagram.source]
        for destination in ((interface.network.broadcast_address, EVERYWHERE) if datagram.destination == EVERYONE
                            else (interface.address,)):
            if (packet := unpack_udp(datagram.payload, source, destination)) is not None:
                return packet
        return None

    def _deliver(self, packet: UdpPacket, interface: IpInterface | None) -> None:
        """Put a datagram into the buffers of the sockets that it is for."""
        source = (str(packet.source), packet.source_port)
        fits = [one for one in self.sockets if one.takes(packet, source)]
        everyone = packet.destination == EVERYWHERE or (
            interface is not None and packet.destination == interface.network.broadcast_address) or any(
            packet.destination == one.network.broadcast_address for one in self.interfaces)
        if fits and not everyone:               # the most particular socket; among equals the one bound last
            fits = [max(enumerate(fits), key=lambda found: (found[1].peer is not None, found[1].address != ANY,
                                                            found[0]))[1]]
        for one in fits:
            if not one.receive(packet.payload, source) and interface is not None:
                self.program.node.count(f"{interface.medium}.rx_dropped")
        if not fits and interface is not None:
            self.program.node.count(f"{interface.medium}.no_socket")

    def _networks(self) -> str:
        return ", ".join(f"{one.address} in {one.network} on {one.medium}" for one in self.interfaces)


def stack_of(program: BlockingProgram) -> Stack:
    """Return the stack of a program that has interfaces."""
    found = program.shared.get(("sockets", ""))
    if found is None:
        found = program.shared["sockets", ""] = Stack(program)
    assert isinstance(found, Stack)
    return found
