"""Who hears whom: the directed graph over which a radio works, as a function of time.

A member of this kind is a settings class with one verb, `over`: it lays itself over the nodes of a medium and returns a
`Topology`, a function of time: the same instant gives the same answer whenever it is asked.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from netem.topology.reach import Reach

Edge = tuple[str, str]          # (sender, receiver)
Position = Sequence[float]      # [m], two or three coordinates


class TopologyError(ValueError):
    """A mistake in a scenario's topology; the message holds every problem found, one a line."""


Graph = dict[str, Reach]        # one entry for every node as a sender


class Topology(Protocol):
    def reach_at(self, sender: str, t_ns: int) -> Reach:
        """Where a frame that `sender` starts at `t_ns` gets to."""

    def graph_at(self, t_ns: int) -> list[Edge]:
        """(sender, receiver) for everyone in range at `t_ns`, in the order of the nodes."""

    def changes_ns(self, until_ns: int) -> list[int]:
        """The instants in (0, until_ns) at which the graph changes."""


@dataclass(frozen=True)
class Site:
    """What a topology is laid over: the nodes of one medium, where they stand, and their radio."""

    nodes: tuple[str, ...]
    at_m: Mapping[str, Position]
    tx_power_dbm: float
    sensitivity_dbm: float


class TopologyKind(Protocol):
    def over(self, site: Site) -> Topology:
        """Raise `TopologyError` for links, graphs or positions that do not fit the nodes."""


def reach(site: Site, rx_dbm: Mapping[str, float], fringe_db: float) -> Reach:
    """Intended are those who get at least `fringe_db` below the sensitivity."""
    receivers = tuple(node for node in site.nodes
                      if node in rx_dbm and rx_dbm[node] >= site.sensitivity_dbm - fringe_db)
    in_range = frozenset(node for node in receivers if rx_dbm[node] >= site.sensitivity_dbm)
    return Reach(receivers, in_range, frozenset(receivers) - in_range, dict(rx_dbm))
