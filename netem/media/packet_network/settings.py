"""The keys of `[media.<name>]` for a packet network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, Final, Literal

from netem.core.nearest import did_you_mean
from netem.media import MediumSettings
from netem.media.answers import DatagramFormat
from netem.media.packet_network.datagram import EVERYONE, MOST_NAME_BYTES
from netem.media.packet_network.routes import Link, Routes
from netem.topology.link_names import edges

FASTEST_BPS: Final = 1_000_000_000_000      # 1 Tbit/s: at least 8 ps a byte, rounded up to whole nanoseconds a packet
ALL_TO_ALL: Final = "* <-> *"


@dataclass(frozen=True)
class LinkSettings:
    """Values of one entry of `links` that replace those of the medium; None: the medium's."""

    rate_bps: int | None = None
    delay_ns: int | None = None
    queue_packets: int | None = None
    queue_bytes: int | None = None
    mtu_bytes: int | None = None


@dataclass(frozen=True)
class PacketNetworkSettings(MediumSettings):
    link_type: ClassVar = 149               # USER2
    rate_bps: int                           # of each direction of a link
    delay_ns: int = 0                       # propagation, from the last bit sent to the last bit received
    queue_packets: int = 1000               # most packets that wait for a link (netem's `limit` has this default)
    queue_bytes: int | None = None          # most bytes that wait for a link; None: only queue_packets limits
    mtu_bytes: int = 1500                   # longest packet, header included
    header_bytes: int = 20                  # of every packet and fragment; IPv4 has 20 without options
    overhead_bytes: int = 0                 # of the link, beside the packet: an Ethernet frame takes 38 bytes more
    longer_than_mtu: Literal["fragment", "refuse"] = "fragment"
    checksum: bool = True                   # a receiver drops datagrams with flipped bits
    switches: tuple[str, ...] = ()
    links: dict[str, LinkSettings] = field(default_factory=dict)    # by "one <-> other"; none: each node with each
    groups: dict[str, tuple[str, ...]] = field(default_factory=dict)    # multicast: group -> its nodes

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if name in LEAST and value is not None:
                _check(name, value, self.header_bytes)
        for link, own in self.links.items():
            for each in fields(own):
                if (value := getattr(own, each.name)) is not None:
                    _check(f"links: {link}: {each.name}", value, self.header_bytes)
        for group, members in self.groups.items():
            if group == EVERYONE:
                raise ValueError(f"groups: {group}: this name means all nodes; choose another")
            if not members:
                raise ValueError(f"groups: {group}=[]: expected at least one node")

    def datagram_format(self) -> DatagramFormat:
        least = min([self.mtu_bytes, *(own.mtu_bytes for own in self.links.values() if own.mtu_bytes is not None)])
        return DatagramFormat(least - self.header_bytes, addressed=True)

    def routes(self, nodes: Sequence[str]) -> Routes:
        """Return the network between `nodes`; ValueError, one line a mistake, for names and links that do not fit."""
        problems = list(self._wrong_names(nodes))
        names = [*nodes, *self.switches]
        if self.switches and not self.links:
            problems.append(f"switches={list(self.switches)}: links does not say what is connected to them")
        given: dict[tuple[str, str], dict[str, Any]] = {}
        for text, own in (self.links or {ALL_TO_ALL: LinkSettings()}).items():
            found, wrong = edges(text, names)
            problems.extend(f"links: {problem}" for problem in wrong)
            for edge in found:
                given.setdefault(edge, {}).update(
                    {each.name: value for each in fields(own) if (value := getattr(own, each.name)) is not None})
        links = [Link(tail, head, **self._defaults() | values) for (tail, head), values in given.items()]
        routes = Routes(nodes, self.switches, links)
        if not problems and len(nodes) > 1:
            alone = [node for node in nodes if not routes.reachable(node) and not routes.heard(node)]
            problems = [f"links: {node} is on no path to another node: connect it, for example \"{node} <-> "
                        f"{self.switches[0] if self.switches else next(n for n in nodes if n != node)}\""
                        for node in alone]
        if problems:
            raise ValueError("\n".join(problems))
        return routes

    def members(self, nodes: Sequence[str]) -> Mapping[str, tuple[str, ...]]:
        """Return the nodes of every group, EVERYONE included."""
        return {EVERYONE: tuple(nodes), **self.groups}

    def _defaults(self) -> dict[str, Any]:
        return {each.name: getattr(self, each.name) for each in fields(LinkSettings)} | {
            "overhead_bytes": self.overhead_bytes}

    def _wrong_names(self, nodes: Sequence[str]) -> Sequence[str]:
        there = f"the nodes of this medium are {', '.join(nodes)}"
        problems = [f"groups: {group}: no node is called {name!r}: {did_you_mean(name, nodes, there)}"
                    for group, members in self.groups.items() for name in members if name not in nodes]
        problems += [f"groups: {group}: a node has this name; choose another" for group in self.groups
                     if group in nodes]
        problems += [f"switches: {switch}: a node has this name; choose another" for switch in self.switches
                     if switch in nodes]
        problems += [f"switches: {switch}: named twice" for index, switch in enumerate(self.switches)
                     if switch in self.switches[:index]]
        return problems + [f"{name[:40]!r}: a name on a packet network has at most {MOST_NAME_BYTES} bytes in UTF-8"
                           for name in (*nodes, *self.groups) if len(name.encode()) > MOST_NAME_BYTES]


LEAST: Final[Mapping[str, int]] = {"rate_bps": 1, "delay_ns": 0, "queue_packets": 0, "queue_bytes": 0, "mtu_bytes": 0,
                                   "header_bytes": 1, "overhead_bytes": 0}


def _check(place: str, value: int, header_bytes: int) -> None:
    """Raise ValueError unless `value` is in the range of the key that `place` ends with."""
    key = place.rpartition(" ")[2]
    if key == "mtu_bytes" and value < header_bytes + 8:
        raise ValueError(f"{place}={value}: expected at least header_bytes + 8 = {header_bytes + 8}: a fragment "
                         "carries 8 bytes or more")
    if key == "header_bytes" and value < 1:
        raise ValueError(f"{place}={value}: expected at least 1: a packet names its receiver")
    if key == "rate_bps" and value > FASTEST_BPS:
        raise ValueError(f"{place}={value}: expected at most {FASTEST_BPS}")
    if value < LEAST[key]:
        raise ValueError(f"{place}={value}: expected at least {LEAST[key]}")
