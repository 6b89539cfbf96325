"""The bytes of a UDP datagram, alone and in an IPv4 packet, with both checksums.

    IPv4 header, 20 bytes (RFC 791)     version 4, no options, time to live 64, protocol 17, no fragments
    UDP header, 8 bytes (RFC 768)       source port, destination port, length, checksum over a pseudo header
    checksum = complement of the sum of all 16-bit words in ones' complement (RFC 1071)

Not modelled: fragments, options, a datagram without checksum (it is accepted, never sent).
"""

from __future__ import annotations

import struct
from ipaddress import IPv4Address
from typing import Final, NamedTuple

IP_HEADER: Final = struct.Struct("!BBHHHBBH4s4s")
UDP_HEADER: Final = struct.Struct("!HHHH")
UDP: Final = 17
TIME_TO_LIVE: Final = 64
LONGEST_PAYLOAD: Final = 65_535 - IP_HEADER.size - UDP_HEADER.size


class UdpPacket(NamedTuple):
    source: IPv4Address
    source_port: int
    destination: IPv4Address
    destination_port: int
    payload: bytes


def pack_udp(packet: UdpPacket) -> bytes:
    """Return the UDP datagram: header and payload."""
    length = UDP_HEADER.size + len(packet.payload)
    head = UDP_HEADER.pack(packet.source_port, packet.destination_port, length, 0)
    checksum = _checksum(_pseudo_header(packet.source, packet.destination, length) + head + packet.payload) or 0xFFFF
    return UDP_HEADER.pack(packet.source_port, packet.destination_port, length, checksum) + packet.payload


def unpack_udp(data: bytes, source: IPv4Address, destination: IPv4Address) -> UdpPacket | None:
    """Read a UDP datagram between two hosts; None if its length or checksum is wrong."""
    if len(data) < UDP_HEADER.size:
        return None
    source_port, destination_port, length, checksum = UDP_HEADER.unpack_from(data)
    if not UDP_HEADER.size <= length <= len(data):
        return None
    if checksum and _checksum(_pseudo_header(source, destination, length) + data[:length]):
        return None
    return UdpPacket(source, source_port, destination, destination_port, data[UDP_HEADER.size:length])


def pack_ip(packet: UdpPacket, number: int) -> bytes:
    """Return the IPv4 packet; `number` is its identification."""
    datagram = pack_udp(packet)
    fields = (0x45, 0, IP_HEADER.size + len(datagram), number & 0xFFFF, 0, TIME_TO_LIVE, UDP)
    addresses = packet.source.packed, packet.destination.packed
    return IP_HEADER.pack(*fields, _checksum(IP_HEADER.pack(*fields, 0, *addresses)), *addresses) + datagram


def unpack_ip(data: bytes) -> UdpPacket | None:
    """Read an IPv4 packet with a whole UDP datagram; None if it is none, or one of its checksums is wrong."""
    if len(data) < IP_HEADER.size:
        return None
    version, _, length, _, fragment, _, protocol, _, source, destination = IP_HEADER.unpack_from(data)
    if version != 0x45 or protocol != UDP or fragment & 0x3FFF or not IP_HEADER.size <= length <= len(data):
        return None
    if _checksum(data[:IP_HEADER.size]):
        return None
    return unpack_udp(data[IP_HEADER.size:length], IPv4Address(source), IPv4Address(destination))


def _pseudo_header(source: IPv4Address, destination: IPv4Address, length: int) -> bytes:
    return source.packed + destination.packed + struct.pack("!BBH", 0, UDP, length)


def _checksum(data: bytes) -> int:
    """Return the Internet checksum; 0 over data that contain their right checksum."""
    if len(data) % 2:
        data += b"\0"
    total = int.from_bytes(data, "big") % 0xFFFF        # the sum of 16-bit words with end-around carry
    return 0xFFFF - (total or 0xFFFF) if any(data) else 0xFFFF
