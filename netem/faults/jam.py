"""A jammer on a radio channel: bursts of noise that no frame survives at the receivers that hear them.

    burst k: [start + k period, start + k period + duty_cycle period), within the window; duty_cycle = 1: all of it

The jammer is heard by `nodes`, or by those that stand in the `zone`. With `sensed`, carrier sense takes a burst for a
carrier, and waits; without, the jammer is as narrow or as clever that nobody notices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import dist
from typing import ClassVar, Literal

from netem.faults import Fault, Site, Target, World
from netem.faults.schedule import Occurrence


@dataclass(frozen=True)
class JammedZone:
    """Nodes inside or on the edge are jammed; distances are horizontal."""

    kind: Literal["rectangle", "circle"]
    low_m: tuple[float, float] | None = None
    high_m: tuple[float, float] | None = None
    centre_m: tuple[float, float] | None = None
    radius_m: float | None = None

    def __post_init__(self) -> None:
        box, disk = (self.low_m, self.high_m), (self.centre_m, self.radius_m)
        wanted, other = (box, disk) if self.kind == "rectangle" else (disk, box)
        if None in wanted or other != (None, None):
            raise ValueError("zone: expected low_m and high_m of a rectangle, or centre_m and radius_m of a circle")
        if self.radius_m is not None and self.radius_m < 0:
            raise ValueError(f"zone: radius_m={self.radius_m}: expected radius_m >= 0")
        if self.low_m is not None and self.high_m is not None and not (
                self.low_m[0] <= self.high_m[0] and self.low_m[1] <= self.high_m[1]):
            raise ValueError(f"zone: low_m={list(self.low_m)}: expected at most high_m={list(self.high_m)} in both "
                             "coordinates")

    def holds(self, at_m: Sequence[float]) -> bool:
        if self.centre_m is not None and self.radius_m is not None:
            return dist(self.centre_m, at_m[:2]) <= self.radius_m
        assert self.low_m is not None
        assert self.high_m is not None
        return all(low <= x <= high for low, x, high in zip(self.low_m, at_m, self.high_m, strict=False))


@dataclass(frozen=True)
class Jam(Fault):
    on: ClassVar = "media"
    strikes: ClassVar = "channel"
    zone: JammedZone | None = None
    nodes: tuple[str, ...] = ()
    duty_cycle: float = 1.0
    period_ns: int | None = None
    sensed: bool = True

    def __post_init__(self) -> None:
        if (self.zone is None) == (not self.nodes):
            raise ValueError("zone: expected either a zone or nodes, which say where the jammer is heard")
        if not 0 < self.duty_cycle <= 1:
            raise ValueError(f"duty_cycle={self.duty_cycle}: expected 0 < duty_cycle <= 1")
        if (self.duty_cycle < 1) != (self.period_ns is not None):
            raise ValueError(f"duty_cycle={self.duty_cycle}: below 1 it needs a period, and 1 has none")
        if self.period_ns is not None and not 0 < round(self.duty_cycle * self.period_ns) < self.period_ns:
            raise ValueError(f"period_ns={self.period_ns}: expected a burst and a pause of at least 1 ns each")

    def resolve(self, on: str, site: Site) -> list[Target]:
        media = super().resolve(on, site)
        for medium, in media:
            self.on_nodes(self.nodes, medium, site.nodes_on[medium], "nodes")
        return media

    def refusal(self, target: Target, site: Site) -> str:
        medium, = target
        if self.zone is None or site.located.get(medium):
            return ""
        return (f"zone={self.zone.kind}: no node on {medium!r} stands anywhere, so none is in the zone: give agents "
                "at_m = [x, y], or name nodes in place of the zone")

    def strike(self, world: World, cause: str, targets: Sequence[Target], occurrence: Occurrence) -> None:
        burst_ns = None if self.period_ns is None else round(self.duty_cycle * self.period_ns)
        fields = {"holds": None if self.zone is None else self.zone.holds, "nodes": self.nodes, "sensed": self.sensed,
                  "period_ns": self.period_ns, "burst_ns": burst_ns}
        for target in targets:
            world.on_medium(target, "jammed", cause, fields, occurrence)
