"""Reads `[gateways.NAME]`: connections to devices and programs outside the emulator, in real time."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from experiments.scenario.model import GatewaySpec, MediumSpec
from experiments.scenario.problems import near
from experiments.scenario.sections import Reading
from experiments.scenario.shape import shape_of
from netem.gateways.network_settings import NetworkSettings
from netem.gateways.table import GATEWAYS, USUAL


@dataclass(frozen=True)
class GatewayHeader:
    medium: str
    kind: str = USUAL
    timesync: bool = False              # the gateway asks the device for its clock (MAVLink TIMESYNC)


def read_gateways(tables: Mapping[str, Any], agents: Collection[str], media: Collection[str],
                  reading: Reading) -> dict[str, GatewaySpec]:
    found: dict[str, GatewaySpec] = {}
    common = shape_of(GatewayHeader).keys()
    for name, raw in tables.items():
        place = ("gateways", name)
        reading.check_name(place, name)
        if name in agents:
            reading.problems.add(place, "is the name of an agent already; take another one")
        kind = raw.get("kind", USUAL) if isinstance(raw, dict) else USUAL
        cls = GATEWAYS[kind].Settings if isinstance(kind, str) and kind in GATEWAYS else None
        if cls is None:
            reading.problems.add((*place, "kind"), f"no such kind; {near(kind, GATEWAYS)}", kind)
            continue
        own = {key: value for key, value in raw.items() if key not in common} if isinstance(raw, dict) else {}
        header = {key: value for key, value in raw.items() if key in common} if isinstance(raw, dict) else raw
        table = reading.tables.read(shape_of(GatewayHeader), header, place, shape_of(cls).keys(), GatewayHeader).made
        if table is not None and table.medium not in media:
            reading.problems.add((*place, "medium"), f"no such medium; {near(table.medium, media)}", table.medium)
        settings = reading.tables.read(shape_of(cls), own, place, common, cls).made
        if table is not None and settings is not None:
            found[name] = GatewaySpec(name, table.medium, kind, settings, table.timesync)
    _check_addresses(found, reading)
    return found


def _check_addresses(gateways: Mapping[str, GatewaySpec], reading: Reading) -> None:
    """Refuse two gateways that would need the same address or device."""
    first: dict[str, str] = {}
    for name, spec in gateways.items():
        for address in spec.settings.occupies():
            other = first.setdefault(address, name)
            if other != name:
                reading.problems.add(("gateways", name), f"has {address}, which gateways.{other} has already; give "
                                     "each one of its own, or let the clients share one gateway")


def check_doors(gateways: Mapping[str, GatewaySpec], network: NetworkSettings, reading: Reading) -> None:
    """Refuse doors with TLS in a scenario without certificates."""
    for name, spec in gateways.items():
        if spec.settings.door(name) is not None and network.tls is None:
            reading.problems.add(("gateways", name, "listen"), "a door with TLS needs certificates; make a folder of "
                                 "them with marconet certificates new FOLDER, and write [network] tls = \"FOLDER\"",
                                 spec.settings.listen)


def check_media(gateways: Mapping[str, GatewaySpec], media: Mapping[str, MediumSpec], reading: Reading) -> None:
    """Refuse gateways that cannot be on their medium."""
    for name, spec in gateways.items():
        settings = media[spec.medium].settings if spec.medium in media else None
        if settings is not None:
            why = spec.settings.refusal(carries_can_frames=settings.carries_can_frames,
                                        datagrams=settings.datagram_format())
            if why:
                reading.problems.add(("gateways", name, "medium"), why, spec.medium)
