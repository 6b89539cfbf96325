"""Topologies: the directed graph of the nodes that hear each other on a radio, as a function of time.

A member of this kind is a settings class with one verb, `over`: given the nodes of a medium it returns a `Topology`.
The answers of one that does not move depend on the instant asked for only, not on the order of the calls. Those of one
that moves depend on the positions shown to it so far, so it is asked about the present only.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from random import Random
from typing import NamedTuple, Protocol

from netem.topology.reach import Reach

Edge = tuple[str, str]          # (sender, receiver)
Position = Sequence[float]      # [m], two or three coordinates


class TopologyError(ValueError):
    """A scenario's topology is wrong; the message lists every problem found, one a line."""


Graph = dict[str, Reach]        # one entry for every node as a sender


class Topology(Protocol):
    @property
    def moves(self) -> bool:
        """Whether the graph follows positions that are shown during the run, so that nothing is known before it."""

    @property
    def propagates(self) -> bool:
        """Whether a frame takes time to reach a node: whether every reach has `delays_ns`."""

    def show(self, node: str, at_m: Position, t_ns: int) -> bool:
        """Take the position of a node of `Bodies` at `t_ns`, before any question about `t_ns` or later.

        Return whether a link may have appeared or disappeared since the last call of `compare`.
        """

    def compare(self, t_ns: int) -> tuple[list[Edge], list[Edge]]:
        """Return the links that have appeared and those that have disappeared since the last call, in order of nodes.

        Only of a topology that moves, after all positions at `t_ns` have been shown.
        """

    def reach_at(self, sender: str, t_ns: int) -> Reach:
        """The nodes that a frame reaches if `sender` starts to transmit it at `t_ns`."""

    def graph_at(self, t_ns: int) -> list[Edge]:
        """Every (sender, receiver) with the receiver in range at `t_ns`, in the order of the nodes.

        For a topology that moves: every pair, as any two nodes may come into range.
        """

    def position(self, node: str, t_ns: int) -> Position | None:
        """The position of a node at `t_ns` [m]; None for one that stands nowhere."""

    def changes_ns(self, until_ns: int) -> list[int]:
        """The instants in (0, until_ns) at which the graph changes: of one that moves, those compared so far."""


@dataclass(frozen=True)
class Site:
    """The nodes of one radio medium, their positions in m, and the properties of their radios.

    `rng_for` returns the random stream of a place of this medium, the same one whenever it is asked.
    """

    nodes: tuple[str, ...]
    at_m: Mapping[str, Position]
    tx_power_dbm: float
    sensitivity_dbm: float
    rng_for: Callable[[str], Random] = Random


class Bodies(NamedTuple):
    """The nodes whose plants say where they are, at 0, period, 2 period, ..."""

    period_ns: int
    outputs: Mapping[str, tuple[str, ...]]      # by node: outputs of its plant for x, y or x, y, z [m]


class WeakArea(Protocol):
    """A convex area on the ground whose links are weak."""

    def extent_m(self, ux: float, uy: float) -> float:
        """Return the greatest ux x + uy y [m] in the area, for a direction (ux, uy) of length 1."""

    def outline_m(self) -> Sequence[tuple[float, float]]:
        """Return corners (x, y) [m] of the area, or of a polygon that looks like it."""


class TopologyKind:
    """What the settings of every topology answer; the defaults are those of one that has no positions."""

    def over(self, site: Site) -> Topology:
        """Return the topology of the nodes of `site`; raises `TopologyError` if links or positions do not fit them."""
        raise NotImplementedError

    def moving(self) -> Bodies:
        """Return the nodes that the topology follows while their plants move them."""
        return Bodies(1, {})

    def standing(self, nodes: Sequence[str]) -> Collection[str]:
        """Return those of `nodes` from whose constant positions the links follow."""
        return ()

    def weak_areas(self) -> Sequence[WeakArea]:
        """Return the areas that weaken links, in the order of the settings."""
        return ()

    def located(self, at_m: Mapping[str, Position | None]) -> Collection[str]:
        """Return the nodes whose position the topology knows; `at_m` has those of the scenario, None: no position."""
        return [node for node, position in at_m.items() if position is not None]


def reach(site: Site, rx_dbm: Mapping[str, float], fringe_db: float) -> Reach:
    """Sort the nodes by the power `rx_dbm` that they receive from one sender.

    Intended receivers get at least the sensitivity less `fringe_db`; those that get the sensitivity are in range.
    """
    receivers = tuple(node for node in site.nodes
                      if node in rx_dbm and rx_dbm[node] >= site.sensitivity_dbm - fringe_db)
    in_range = frozenset(node for node in receivers if rx_dbm[node] >= site.sensitivity_dbm)
    return Reach(receivers, in_range, frozenset(receivers) - in_range, dict(rx_dbm))
