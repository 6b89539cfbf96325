"""Links from the positions of the nodes: log-distance path loss (Rappaport, Wireless Communications, 2nd ed., 4.9).

    rx_dbm = tx_power_dbm - reference_loss_db - 10 exponent log10(max(d, d0) / d0) - losses of zones       [d in m]

A zone of poor communication adds its loss once to a link with at least one end inside or on its edge. A node that
receives at least the sensitivity is in range. One that receives up to `fringe_db` less is an intended receiver, whose
copies end as too weak. A node further out is no intended receiver; the frame still interferes there under `capture`.

Not modelled: movement, shadowing, fading, antennas, a link that crosses a zone with both ends outside.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import dist, log10
from typing import Annotated, Literal

from netem.topology import Position, Site, TopologyError, reach
from netem.topology.timetable import Timetable
from netem.topology.told_apart import ToldApartBy


@dataclass(frozen=True)
class Rectangle:
    kind: Literal["rectangle"]
    low_m: tuple[float, float]
    high_m: tuple[float, float]
    extra_loss_db: float

    def __post_init__(self) -> None:
        if not (self.low_m[0] <= self.high_m[0] and self.low_m[1] <= self.high_m[1]):
            raise ValueError(f"low_m={self.low_m}: expected at most high_m={self.high_m} in both coordinates")

    def holds(self, at_m: Position) -> bool:
        return all(low <= x <= high for low, x, high in zip(self.low_m, at_m, self.high_m, strict=False))


@dataclass(frozen=True)
class Circle:
    kind: Literal["circle"]
    centre_m: tuple[float, float]
    radius_m: float
    extra_loss_db: float

    def __post_init__(self) -> None:
        if self.radius_m < 0:
            raise ValueError(f"radius_m={self.radius_m}: expected radius_m >= 0")

    def holds(self, at_m: Position) -> bool:
        return dist(self.centre_m, tuple(at_m)[:2]) <= self.radius_m


Zone = Annotated[Rectangle | Circle, ToldApartBy("kind")]


@dataclass(frozen=True)
class PathLoss:
    kind: Literal["positions"]
    at_m: dict[str, tuple[float, ...]] | None = None        # by node; overrules its position in the scenario
    reference_distance_m: float = 1.0
    reference_loss_db: float = 40.0                         # free space at 2.45 GHz and 1 m: 40.2 dB
    exponent: float = 2.0
    fringe_db: float = 10.0
    zones: tuple[Zone, ...] = ()

    def __post_init__(self) -> None:
        if self.reference_distance_m <= 0:
            raise ValueError(f"reference_distance_m={self.reference_distance_m}: expected > 0")
        if self.exponent < 0:
            raise ValueError(f"exponent={self.exponent}: expected >= 0")
        if self.fringe_db < 0:
            raise ValueError(f"fringe_db={self.fringe_db}: expected >= 0")

    def over(self, site: Site) -> Timetable:
        at_m: dict[str, Position] = {**site.at_m, **(self.at_m or {})}
        problems = [f"positions: {node!r} stands nowhere: give the node at_m = [x, y]"
                    for node in site.nodes if node not in at_m]
        problems += [f"positions: at_m of {node!r} has {len(at_m[node])} coordinates: expected 2 or 3, the same for all"
                     for node in site.nodes if node in at_m
                     and (len(at_m[node]) not in (2, 3) or len(at_m[node]) != len(next(iter(at_m.values()))))]
        problems += [f"positions: at_m names {node!r}, which has no port on this medium: the nodes are "
                     f"{', '.join(site.nodes)}" for node in self.at_m or {} if node not in site.nodes]
        if problems:
            raise TopologyError("\n".join(problems))
        graph = {sender: reach(site, {receiver: site.tx_power_dbm - self.loss_db(at_m[sender], at_m[receiver])
                                      for receiver in site.nodes if receiver != sender}, self.fringe_db)
                 for sender in site.nodes}
        return Timetable([0], [graph], at_m=at_m)

    def loss_db(self, one_m: Position, other_m: Position) -> float:
        """Loss between two positions, with that of the zones that hold either."""
        d, d0 = dist(one_m, other_m), self.reference_distance_m
        loss = self.reference_loss_db + 10 * self.exponent * log10(max(d, d0) / d0)
        return loss + sum(zone.extra_loss_db for zone in self.zones if zone.holds(one_m) or zone.holds(other_m))
