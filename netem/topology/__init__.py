"""Topologies: the directed graph of the nodes that hear each other on a radio, as a function of time.

A member of this kind is a settings class with one verb, `over`: given the nodes of a medium it returns a `Topology`,
whose answers depend on the instant asked for only, not on the order of the calls.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from netem.topology.reach import Reach

Edge = tuple[str, str]          # (sender, receiver)
Position = Sequence[float]      # [m], two or three coordinates


class TopologyError(ValueError):
    """A scenario's topology is wrong; the message lists every problem found, one a line."""


Graph = dict[str, Reach]        # one entry for every node as a sender


class Topology(Protocol):
    def reach_at(self, sender: str, t_ns: int) -> Reach:
        """The nodes that a frame reaches if `sender` starts to transmit it at `t_ns`."""

    def graph_at(self, t_ns: int) -> list[Edge]:
        """Every (sender, receiver) with the receiver in range at `t_ns`, in the order of the nodes."""

    def position(self, node: str, t_ns: int) -> Position | None:
        """The position of a node at `t_ns` [m]; None for one that stands nowhere."""

    def changes_ns(self, until_ns: int) -> list[int]:
        """The instants in (0, until_ns) at which the graph changes."""


@dataclass(frozen=True)
class Site:
    """The nodes of one radio medium, their positions in m, and the properties of their radios."""

    nodes: tuple[str, ...]
    at_m: Mapping[str, Position]
    tx_power_dbm: float
    sensitivity_dbm: float


class TopologyKind(Protocol):
    def over(self, site: Site) -> Topology:
        """Return the topology of the nodes of `site`; raises `TopologyError` if links or positions do not fit them."""


def reach(site: Site, rx_dbm: Mapping[str, float], fringe_db: float) -> Reach:
    """Sort the nodes by the power `rx_dbm` that they receive from one sender.

    Intended receivers get at least the sensitivity less `fringe_db`; those that get the sensitivity are in range.
    """
    receivers = tuple(node for node in site.nodes
                      if node in rx_dbm and rx_dbm[node] >= site.sensitivity_dbm - fringe_db)
    in_range = frozenset(node for node in receivers if rx_dbm[node] >= site.sensitivity_dbm)
    return Reach(receivers, in_range, frozenset(receivers) - in_range, dict(rx_dbm))
