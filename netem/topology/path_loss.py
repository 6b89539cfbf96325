"""Links from the positions of the nodes: log-distance path loss (Rappaport, Wireless Communications, 2nd ed., 4.9).

    rx_dbm = tx_power_dbm - reference_loss_db - 10 exponent log10(max(d, d0) / d0)                         [d in m]
             - losses of zones - shadowing

With `two_ray` the two-ray ground law takes the place of the log-distance law. A node that receives at least the
sensitivity is in range. One that receives up to `fringe_db` less is an intended receiver, whose copies end as too weak.
A node further out is no intended receiver; the frame still interferes there under `capture`.

A node stands at its `at_m`, or follows its plant (`bodies`, see moving_graph.py).

Not modelled: fading, antennas.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import dist, inf, isfinite, log10
from typing import Final, Literal

from netem.topology import Bodies, Position, Site, Topology, TopologyError, TopologyKind, WeakArea, reach
from netem.topology.moving_graph import MovingGraph
from netem.topology.reach import Reach
from netem.topology.shadowing import ShadowField, Shadowing
from netem.topology.timetable import Timetable
from netem.topology.two_ray import TwoRay
from netem.topology.zones import Zone

REFERENCE_LOSS_DB: Final = 40.0         # free space at 2.45 GHz and 1 m: 40.2 dB
EXPONENT: Final = 2.0
MOST_DECADES: Final = 30                # of distance: nobody is further away


@dataclass(frozen=True)
class PathLoss(TopologyKind):
    kind: Literal["positions"]
    at_m: dict[str, tuple[float, ...]] | None = None        # by node; overrules its position in the scenario
    reference_distance_m: float = 1.0
    reference_loss_db: float = REFERENCE_LOSS_DB
    exponent: float = EXPONENT
    fringe_db: float = 10.0
    zones: tuple[Zone, ...] = ()
    bodies: dict[str, tuple[str, ...]] = field(default_factory=dict)    # by node: plant's outputs for x, y or x, y, z
    pose_period_ns: int = 10_000_000                        # bodies show their positions at 0, period, 2 period, ...
    two_ray: TwoRay | None = None                           # in place of reference_loss_db and exponent
    shadowing: Shadowing | None = None
    propagation_mps: float | None = None                    # None: a frame arrives everywhere at once

    def __post_init__(self) -> None:
        if self.reference_distance_m <= 0:
            raise ValueError(f"reference_distance_m={self.reference_distance_m}: expected > 0")
        if self.exponent < 0:
            raise ValueError(f"exponent={self.exponent}: expected >= 0")
        if self.fringe_db < 0:
            raise ValueError(f"fringe_db={self.fringe_db}: expected >= 0")
        if self.pose_period_ns < 1:
            raise ValueError(f"pose_period_ns={self.pose_period_ns}: expected at least 1")
        if self.propagation_mps is not None and not (isfinite(self.propagation_mps) and self.propagation_mps > 0):
            raise ValueError(f"propagation_mps={self.propagation_mps}: expected > 0; light has 299792458, sound in "
                             "water about 1500")
        if self.two_ray is not None and (self.reference_loss_db, self.exponent) != (REFERENCE_LOSS_DB, EXPONENT):
            raise ValueError("two_ray: has no reference_loss_db and no exponent; leave them out, or two_ray")

    def moving(self) -> Bodies:
        return Bodies(self.pose_period_ns, self.bodies)

    def standing(self, nodes: Sequence[str]) -> Collection[str]:
        return [node for node in nodes if node not in self.bodies]

    def weak_areas(self) -> Sequence[WeakArea]:
        return self.zones

    def located(self, at_m: Mapping[str, Position | None]) -> Collection[str]:
        return at_m.keys()          # `over` refuses nodes without one

    def over(self, site: Site) -> Topology:
        at_m: dict[str, Position] = {**site.at_m, **(self.at_m or {})}
        problems = self._problems(site, at_m)
        if problems:
            raise TopologyError("\n".join(problems))
        shadows = None if self.shadowing is None else ShadowField(self.shadowing, site.rng_for)
        reach_of = partial(self._reach, site, shadows)
        propagates = self.propagation_mps is not None
        if self.bodies:
            return MovingGraph(site.nodes, {node: at_m[node] for node in site.nodes if node not in self.bodies},
                               reach_of, propagates, self._range_m(site))
        return Timetable([0], [{sender: reach_of(sender, at_m) for sender in site.nodes}], propagates=propagates,
                         at_m=at_m)

    def _range_m(self, site: Site) -> float | None:
        """Return the distance up to which a node is in range, None if it depends on more than the distance."""
        if self.zones or self.shadowing is not None or self.two_ray is not None:
            return None
        decades = (site.tx_power_dbm - self.reference_loss_db - site.sensitivity_dbm) / (10 * self.exponent) \
            if self.exponent else inf
        return self.reference_distance_m * 10 ** decades if decades < MOST_DECADES else inf

    def loss_db(self, one_m: Position, other_m: Position) -> float:
        """Loss between two positions without shadowing, with that of the zones that weaken the link."""
        d, d0 = dist(one_m, other_m), self.reference_distance_m
        if self.two_ray is not None:
            loss = self.two_ray.loss_db(one_m, other_m, max(d, d0))
        else:
            loss = self.reference_loss_db + 10 * self.exponent * log10(max(d, d0) / d0)
        return loss + sum(zone.extra_loss_db for zone in self.zones if zone.weakens(one_m, other_m))

    def _reach(self, site: Site, shadows: ShadowField | None, sender: str, at_m: dict[str, Position]) -> Reach:
        """Return the reach of `sender` among the nodes that have a position."""
        from_m = at_m[sender]
        rx_dbm: dict[str, float] = {}
        for receiver in site.nodes:
            if receiver != sender and receiver in at_m:
                loss_db = self.loss_db(from_m, at_m[receiver])
                if shadows is not None:
                    loss_db += shadows.loss_db(from_m, at_m[receiver])
                rx_dbm[receiver] = site.tx_power_dbm - loss_db
        found = reach(site, rx_dbm, self.fringe_db)
        if self.propagation_mps is None:
            return found
        delays_ns = {receiver: round(dist(from_m, at_m[receiver]) / self.propagation_mps * 1e9) for receiver in rx_dbm}
        return Reach(found.receivers, found.in_range, found.too_weak, found.rx_dbm, delays_ns)

    def _problems(self, site: Site, at_m: dict[str, Position]) -> list[str]:
        coordinates = {node: len(self.bodies[node]) if node in self.bodies else len(at_m[node]) for node in site.nodes
                       if node in self.bodies or node in at_m}
        first = next(iter(coordinates.values()), 2)
        there = f"which has no port on this medium: the nodes are {', '.join(site.nodes)}"
        problems = [f"positions: {node!r} stands nowhere: give the node at_m = [x, y]"
                    for node in site.nodes if node not in coordinates]
        for node, found in coordinates.items():
            if found not in (2, 3) or found != first:
                of = f"bodies of {node!r} names {found} outputs" if node in self.bodies else \
                    f"at_m of {node!r} has {found} coordinates"
                problems.append(f"positions: {of}: expected 2 or 3, the same for all")
        problems += [f"positions: at_m names {node!r}, {there}" for node in self.at_m or {} if node not in site.nodes]
        problems += [f"positions: bodies names {node!r}, {there}" for node in self.bodies if node not in site.nodes]
        problems += [f"positions: at_m and bodies both say where {node!r} is: name it in one of them"
                     for node in self.bodies if node in (self.at_m or {})]
        return problems
