"""Faults of the CAN controllers of nodes: one goes bus-off, one babbles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

from netem.faults import Fault, Site, Target, World
from netem.faults.candidates import Candidate, Fixed
from netem.faults.schedule import Occurrence

STANDARD_MASK, EXTENDED_MASK = 0x7FF, 0x1FFFFFFF


@dataclass(frozen=True)
class ControllerFault(Fault):
    """`nodes` names those on the bus whose controllers have the fault."""

    on: ClassVar = "media"
    strikes: ClassVar = "bus"
    needs: ClassVar = "a CAN bus with two nodes or more"
    how: ClassVar[str]
    nodes: tuple[str, ...]

    @classmethod
    def candidates(cls, site: Site) -> list[Candidate]:
        return [Candidate(bus, {"nodes": Fixed((node,))}) for bus in cls.targets(site) for node in site.nodes_on[bus]]

    def resolve(self, on: str, site: Site) -> list[Target]:
        if not self.nodes:
            raise ValueError("nodes=[]: name those whose controllers have the fault")
        return [(bus, node) for bus, in super().resolve(on, site)
                for node in self.on_nodes(self.nodes, bus, site.nodes_on[bus], "nodes")]

    def strike(self, world: World, cause: str, targets: Sequence[Target], occurrence: Occurrence) -> None:
        for target in targets:
            world.at(occurrence.start_ns, partial(world.on_medium, target, self.how, cause, self.fields(), occurrence))

    def fields(self) -> Mapping[str, Any]:
        return {}


@dataclass(frozen=True)
class BusOff(ControllerFault):
    """The controller leaves the bus, and recovers as the bus says."""

    how: ClassVar = "off"
    lasting: ClassVar = False


@dataclass(frozen=True)
class Babble(ControllerFault):
    """The controller always has a frame with the identifier `can_id` waiting, `length` bytes of 0x55."""

    how: ClassVar = "babbles"
    can_id: int = 0
    extended: bool = False
    length: int = 8

    def __post_init__(self) -> None:
        if not 0 <= self.can_id <= (EXTENDED_MASK if self.extended else STANDARD_MASK):
            raise ValueError(f"can_id={self.can_id}: expected an identifier of {29 if self.extended else 11} bits"
                             + ("" if self.extended else "; set extended = true for 29"))
        if not 0 <= self.length <= 8:
            raise ValueError(f"length={self.length}: expected 0 to 8 bytes")

    def fields(self) -> Mapping[str, Any]:
        return {"can_id": self.can_id, "extended": self.extended, "length": self.length}
