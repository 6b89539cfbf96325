"""Addresses "host:port" of gateways, and who may speak to a port that is open beyond the loopback.

    "127.0.0.1:14550"   "[::1]:5760"        only_from = ["192.168.1.20", "10.0.0.0/8"]

A host is an IP address, since looking up a name would make the run wait.
"""

from __future__ import annotations

import socket
from collections.abc import Iterable, Iterator, Sequence
from ipaddress import IPv4Network, IPv6Network, ip_address, ip_network
from typing import Any, Final

Address = tuple[Any, ...]               # as sockets have it: (host, port), for IPv6 (host, port, flow, scope)

ADDRESS_RULE: Final = ("expected \"address:port\", an IP address and a port from 0 to 65535, for example "
                       "\"127.0.0.1:14550\" or \"[::1]:14550\"")
BEYOND_RULE: Final = ("is beyond the loopback, where others than this machine could take part: name those who may, for "
                      "example only_from = [\"192.168.1.0/24\"]")
NETWORK_RULE: Final = "expected an IP address or a network, for example \"192.168.1.20\" or \"192.168.1.0/24\""


def address_of(text: str) -> Address:
    """Return the address in `text`. Raises ValueError if it is none."""
    host, _, port = text.rpartition(":")
    if host.startswith("[") and host.endswith("]"):
        host = host[1:-1]
    elif ":" in host:
        raise ValueError(ADDRESS_RULE)
    try:
        version = ip_address(host).version
        number = int(port) if port.isascii() and port.isdigit() else -1
    except ValueError:
        raise ValueError(ADDRESS_RULE) from None
    if not 0 <= number < 65536:
        raise ValueError(ADDRESS_RULE)
    return (host, number) if version == 4 else (host, number, 0, 0)


def family_of(address: Address) -> socket.AddressFamily:
    return socket.AF_INET if ip_address(address[0]).version == 4 else socket.AF_INET6


def text_of(address: Address) -> str:
    host, port = address[:2]
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


class OnlyFrom:
    """The addresses that may speak to a gateway: those of `networks`, or any without networks."""

    def __init__(self, networks: Sequence[str]) -> None:
        self._networks: list[IPv4Network | IPv6Network] = [ip_network(text, strict=False) for text in networks]

    def admits(self, host: str) -> bool:
        return not self._networks or any(ip_address(host) in network for network in self._networks)


def wrong_addresses(only_from: Sequence[str], **given: str | None) -> Iterator[str]:
    """Yield `key=value: rule` for each of `given` that is no address, or is beyond the loopback and not in `only_from`.

    Where a gateway listens, under the key `listen`, any `only_from` opens it; another address has to be among them.
    """
    wrong = list(wrong_networks(only_from))
    yield from wrong
    for key, text in given.items():
        if text is None:
            continue
        try:
            host = address_of(text)[0]
        except ValueError as error:
            yield f"{key}={text}: {error}"
            continue
        if ip_address(host).is_loopback or wrong:
            continue
        if not only_from:
            yield f"{key}={text}: {BEYOND_RULE}"
        elif key != "listen" and not OnlyFrom(only_from).admits(host):
            yield f"{key}={text}: is not among only_from = {list(only_from)}; add it there"


def wrong_networks(only_from: Iterable[str]) -> Iterator[str]:
    """Yield `only_from=value: rule` for each that is neither an address nor a network."""
    for text in only_from:
        try:
            ip_network(text, strict=False)
        except ValueError:
            yield f"only_from={text}: {NETWORK_RULE}"
