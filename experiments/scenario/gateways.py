"""`[gateways.NAME]`: who is outside the emulator and takes part in real time."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from ipaddress import ip_address
from typing import Any

from experiments.scenario.model import GatewaySpec
from experiments.scenario.problems import Place, near
from experiments.scenario.sections import Reading
from experiments.scenario.shape import shape_of

ADDRESS_RULE = "expected \"127.0.0.1:port\": an address of the loopback and a port from 0 to 65535"


@dataclass(frozen=True)
class Table:
    medium: str
    listen: str = "127.0.0.1:0"
    peer: str | None = None


def read_gateways(tables: Mapping[str, Any], agents: Collection[str], media: Collection[str],
                  reading: Reading) -> dict[str, GatewaySpec]:
    found: dict[str, GatewaySpec] = {}
    for name, raw in tables.items():
        place = ("gateways", name)
        reading.check_name(place, name)
        if name in agents:
            reading.problems.add(place, "is the name of an agent already; take another one")
        table = reading.tables.read(shape_of(Table), raw, place, (), Table).made
        if table is None:
            continue
        if table.medium not in media:
            reading.problems.add((*place, "medium"), f"no such medium; {near(table.medium, media)}", table.medium)
        listen = _address(table.listen, (*place, "listen"), reading)
        peer = None if table.peer is None else _address(table.peer, (*place, "peer"), reading)
        if listen is not None:
            found[name] = GatewaySpec(name, table.medium, listen, peer)
    return found


def _address(text: str, place: Place, reading: Reading) -> tuple[str, int] | None:
    host, _, port = text.rpartition(":")
    try:
        if ip_address(host).is_loopback and 0 <= int(port) < 65536:
            return host, int(port)
    except ValueError:
        pass
    reading.problems.add(place, ADDRESS_RULE, text)
    return None
