"""The key `sockets` of an agent: which media carry the datagrams of its program's sockets, and under which addresses.

    sockets = { telemetry = "bare" }            a datagram is one frame; nobody has an address
    sockets = { wifi = "ip" }                   IPv4; addresses follow from the order of the agents and of the media
    sockets = { wifi = "192.168.1.7/24" }       IPv4, this address

The automatic address of the n-th agent of the k-th medium is 10.k.0.0/16 plus n, counted n from 1 and k from 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from ipaddress import IPv4Interface, IPv4Network
from typing import Final

from experiments.scenario.datagram_media import check_programs, complaints_about
from experiments.scenario.model import AgentSpec, MediumSpec, Scenario
from experiments.scenario.problems import Problems
from firmware_sim.sockets.interface import EVERYWHERE, LOOPBACK, Interface

BARE, AUTOMATIC = "bare", "ip"
RULE: Final = 'expected "bare", "ip" or an IPv4 address with its network, such as "192.168.1.7/24"'
WIDEST: Final = 256                 # media with automatic addresses: 10.0.0.0/16 to 10.255.0.0/16


def check_sockets(agents: Mapping[str, AgentSpec], media: Mapping[str, MediumSpec], programs: Mapping[str, bool],
                  problems: Problems) -> None:
    """Add what is wrong with the key of each agent; `programs` says of each whether it is ordinary blocking code."""
    check_programs("sockets", (agent for agent in agents.values() if agent.sockets), programs, problems)
    for agent in agents.values():
        place = ("agents", agent.name, "sockets")
        for name, written in agent.sockets.items():
            for complaint in _complaints(agent, name, written, media):
                problems.add((*place, name), complaint, written)
        bare = [name for name, written in agent.sockets.items() if written == BARE]
        if len(bare) > 1:
            problems.add(place, f"{' and '.join(bare)} are both bare, so a datagram could mean either: give one of "
                                "them addresses")
    for name in media:
        for agent_name, complaint, written in _complaints_about_network(name, agents, list(media)):
            problems.add(("agents", agent_name, "sockets", name), complaint, written)


def interfaces_of(scenario: Scenario, agent: AgentSpec) -> tuple[Interface, ...]:
    """Return the media of the agent's sockets in the order of its media, with the addresses of all nodes on them."""
    return tuple(_interface(medium, scenario, agent.sockets[medium]) for medium in agent.media
                 if medium in agent.sockets)


def _interface(medium: str, scenario: Scenario, written: str) -> Interface:
    addressed = scenario.media[medium].settings.datagram_format().addressed
    if written == BARE:
        return Interface(medium, addressed=addressed)
    found = _addresses(medium, scenario.agents, list(scenario.media))
    network = next(iter(found.values())).network
    return Interface(medium, str(network), {name: str(address.ip) for name, address in found.items()}, addressed)


def _addresses(medium: str, agents: Mapping[str, AgentSpec], media: Sequence[str]) -> dict[str, IPv4Interface]:
    """Return the address of each agent with IP on the medium; without those that are written wrongly."""
    found: dict[str, IPv4Interface] = {}
    on_it = [agent for agent in agents.values() if medium in agent.media]
    network = IPv4Network(f"10.{media.index(medium) % WIDEST}.0.0/16")
    for number, agent in enumerate(on_it, 1):
        written = agent.sockets.get(medium, BARE)
        if written == AUTOMATIC:
            found[agent.name] = IPv4Interface(f"{network[number]}/16")
        elif written != BARE and (address := _read(written)) is not None:
            found[agent.name] = address
    return found


def _read(written: str) -> IPv4Interface | None:
    try:
        return IPv4Interface(written) if "/" in written else None
    except ValueError:
        return None


def _complaints(agent: AgentSpec, name: str, written: str, media: Mapping[str, MediumSpec]) -> Iterator[str]:
    yield from complaints_about(agent, name, media)
    if name not in media:
        return
    if written in (BARE, AUTOMATIC):
        settings = media[name].settings             # None if they are wrong
        format_ = None if settings is None else settings.datagram_format()
        if written == BARE and format_ is not None and format_.addressed:
            yield 'a frame of this medium names its receiver: expected "ip" or an address'
        return
    address = _read(written)
    if address is None:
        yield RULE
    elif address.network.prefixlen > 30:
        yield "expected a network of at least 4 addresses (/30)"
    elif address.ip in (address.network.network_address, address.network.broadcast_address):
        yield f"{address.ip} is the first or the last address of {address.network}, which no host may have"
    elif address.ip.is_multicast or address.network.overlaps(LOOPBACK) or address.ip == EVERYWHERE:
        yield f"{address.ip} is a multicast or loopback address"


def _complaints_about_network(medium: str, agents: Mapping[str, AgentSpec],
                              media: Sequence[str]) -> Iterator[tuple[str, str, str]]:
    """Yield (agent, complaint, value) where agents on one medium contradict each other."""
    modes = {name: agent.sockets[medium] for name, agent in agents.items() if medium in agent.sockets}
    first, *others = modes or {"": ""}
    there = f"{first} has {modes.get(first)!r} on this medium"
    for name in others:
        if (modes[name] == BARE) != (modes[first] == BARE):
            yield name, f"{there}: bare or with addresses, the same for all", modes[name]
        elif (modes[name] == AUTOMATIC) != (modes[first] == AUTOMATIC):
            yield name, f"{there}: automatic addresses for all or for none", modes[name]
    found = _addresses(medium, agents, media)
    taken: dict[object, str] = {}
    for name, address in found.items():
        network = next(iter(found.values())).network
        if address.network != network:
            yield name, f"{next(iter(found))} is in {network}: one network for all", modes[name]
        elif address.ip in taken:
            yield name, f"{taken[address.ip]} has this address", modes[name]
        taken.setdefault(address.ip, name)
    yield from _overlaps(medium, agents, media, found)


def _overlaps(medium: str, agents: Mapping[str, AgentSpec], media: Sequence[str],
              found: Mapping[str, IPv4Interface]) -> Iterator[tuple[str, str, str]]:
    """Yield where an agent is in the same network on two media, so that an address could mean either."""
    for other in media[:media.index(medium)]:
        there = _addresses(other, agents, media)
        for name, address in found.items():
            if name in there and address.network.overlaps(there[name].network):
                yield name, f"{there[name].network} of {other} overlaps it: give each medium a network of its own", \
                    agents[name].sockets[medium]
