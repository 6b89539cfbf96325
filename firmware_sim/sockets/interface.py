"""A medium that carries the datagrams of a program's sockets, as the scenario chose it."""

from __future__ import annotations

from ipaddress import IPv4Address, IPv4Network
from typing import Final

import msgspec

LOOPBACK: Final = IPv4Network("127.0.0.0/8")
EVERYWHERE: Final = IPv4Address("255.255.255.255")


class Interface(msgspec.Struct, frozen=True):
    """One medium. Without a `network` it is *bare*: a datagram is one frame, and nobody has an address.

    With a `network` ("10.0.0.0/16") a frame is an IPv4 packet, and `hosts` has the address of each node on the medium,
    this one included. With `addressed` frames begin with the names of sender and receiver instead of an IPv4 header
    (`netem/media/packet_network/datagram.py`).
    """

    medium: str
    network: str = ""
    hosts: dict[str, str] = {}
    addressed: bool = False
