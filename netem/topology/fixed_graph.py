"""A directed graph that does not change: a list of links.

The receiver of a link gets the power `level_dbm` unless `levels_dbm` names another; only `capture` compares powers.
A link whose power lies below the receiver's sensitivity still has an intended receiver, whose copies end as too weak.

Not modelled: interference between nodes that no link joins.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Literal

from netem.topology import Graph, Site, TopologyError, TopologyKind, reach
from netem.topology.link_names import all_edges, edges
from netem.topology.timetable import Timetable


@dataclass(frozen=True)
class FixedGraph(TopologyKind):
    kind: Literal["fixed"] = "fixed"
    links: tuple[str, ...] = ("* -> *",)
    level_dbm: float = -60.0
    levels_dbm: dict[str, float] = field(default_factory=dict)      # by link; a later entry overrules an earlier one

    def over(self, site: Site) -> Timetable:
        graph, problems = graph_of(self.links, self.level_dbm, self.levels_dbm, site)
        if problems:
            raise TopologyError("\n".join(problems))
        return Timetable([0], [graph], at_m=site.at_m)


def graph_of(links: Sequence[str], level_dbm: float, levels_dbm: Mapping[str, float],
             site: Site) -> tuple[Graph, list[str]]:
    """Return the graph of these links between the nodes of `site`, and the problems found in their names."""
    found, problems = all_edges(links, site.nodes)
    rx_dbm: dict[str, dict[str, float]] = {node: {} for node in site.nodes}
    for sender, receiver in found:
        rx_dbm[sender][receiver] = level_dbm
    for link, level in levels_dbm.items():
        named, wrong = edges(link, site.nodes)
        problems.extend(f"levels_dbm: {problem}" for problem in wrong)
        for sender, receiver in named:
            if receiver in rx_dbm[sender]:
                rx_dbm[sender][receiver] = level
    return {sender: reach(site, heard, fringe_db=inf) for sender, heard in rx_dbm.items()}, problems
