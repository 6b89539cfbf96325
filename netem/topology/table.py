"""The topologies that a scenario can name by `kind`. A new one is a file and a line here."""

from __future__ import annotations

from typing import Annotated, Final

from netem.topology import TopologyKind
from netem.topology.fixed_graph import FixedGraph
from netem.topology.path_loss import PathLoss
from netem.topology.switching_graph import SwitchingGraph
from netem.topology.told_apart import ToldApartBy

TOPOLOGIES: Final[dict[str, type[TopologyKind]]] = {
    "fixed": FixedGraph,
    "switching": SwitchingGraph,
    "positions": PathLoss,
}

TopologySettings = Annotated[FixedGraph | SwitchingGraph | PathLoss, ToldApartBy("kind")]
