"""The nodes of a medium fall into groups between which no frame passes.

    groups = [["r1", "r2"], ["r3"]]     nodes of different groups do not hear each other; one in no group hears all
    shape = "halves"                    the first half of the nodes and the rest
    shape = "bridge"                    two halves that only the node in the middle hears, and that hear it
    shape = "ring"                      each node hears a majority, those next to it in the ring, and no two the same
    shape = "isolate"                   each of `nodes` hears nobody and is heard by nobody

`nodes` has the nodes of a shape in order; without it a shape is made of all nodes of the medium. The shapes are from
Jepsen (Kingsbury, jepsen.nemesis: partition-halves, bridge, partition-majorities-ring, partition-node).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import permutations
from typing import ClassVar, Literal

from netem.faults import Site, Target
from netem.faults.candidates import Candidate, Fixed, OneOf
from netem.faults.link_down import LinkDown


@dataclass(frozen=True)
class Partition(LinkDown):
    """With `one_way`, frames from a group to a later one are lost, and those the other way pass."""

    on: ClassVar = "media"
    needs: ClassVar = "a medium with two nodes or more"
    unset: ClassVar[Mapping[str, str]] = {**LinkDown.unset, "shape": "none, if groups are given"}
    groups: tuple[tuple[str, ...], ...] = ()
    shape: Literal["halves", "ring", "bridge", "isolate"] | None = None
    nodes: tuple[str, ...] = ()
    one_way: bool = False

    def __post_init__(self) -> None:
        if bool(self.groups) == (self.shape is not None):
            raise ValueError("groups: expected either groups = [[...], [...]] or a shape")
        if self.groups and self.nodes:
            raise ValueError("nodes: belong to a shape; groups name theirs themselves")
        if self.shape == "isolate" and not self.nodes:
            raise ValueError("nodes: are missing: name those that are isolated")
        if self.one_way and self.shape not in (None, "halves"):
            raise ValueError(f"one_way=true: has no meaning for shape = \"{self.shape}\"")
        twice = [name for group in self.groups for name in group if sum(name in other for other in self.groups) > 1]
        if twice:
            raise ValueError(f"groups: {twice[0]!r} is in two groups")

    @classmethod
    def candidates(cls, site: Site) -> list[Candidate]:
        return [Candidate(on, {"shape": Fixed("halves"), "one_way": OneOf((True, False)), **cls.carriers_on(on, site)})
                for on in cls.targets(site)]

    def resolve(self, on: str, site: Site) -> list[Target]:
        media = [medium for medium, in super().resolve(on, site)]
        return [(medium, *link) for medium in media for link in self._cut_on(medium, list(site.nodes_on[medium]))]

    def _cut_on(self, medium: str, nodes: list[str]) -> list[tuple[str, str]]:
        if self.groups:
            groups = [self.on_nodes(group, medium, nodes, "groups") for group in self.groups]
        else:
            members = self.on_nodes(self.nodes, medium, nodes, "groups") if self.nodes else nodes
            if self.shape == "ring":
                return self._linked(_ring(members), medium)
            half = (len(members) + 1) // 2
            if self.shape == "isolate":
                return self._linked([(one, other) for one, other in permutations(nodes, 2)
                                     if one in members or other in members], medium)
            if self.shape == "bridge":
                groups = [members[:len(members) // 2], members[half:] if len(members) % 2 else members[half + 1:]]
            else:
                groups = [members[:half], members[half:]]
        return self._linked([(sender, receiver) for place, group in enumerate(groups)
                             for other_place, other in enumerate(groups) if place != other_place
                             and (place < other_place or not self.one_way)
                             for sender in group for receiver in other], medium)

    @staticmethod
    def _linked(links: list[tuple[str, str]], medium: str) -> list[tuple[str, str]]:
        if not links:
            raise ValueError(f"groups: leave all nodes of {medium!r} connected: name nodes in at least two groups")
        return links


def _ring(members: list[str]) -> list[tuple[str, str]]:
    """Cut each node from those further away in the ring than a majority of all reaches, itself included."""
    count = len(members)
    heard = count // 2 + 1                          # a majority
    behind, ahead = (heard - 1) // 2, heard - 1 - (heard - 1) // 2
    kept = {(members[i], members[(i + step) % count]) for i in range(count) for step in range(-behind, ahead + 1)}
    kept |= {(receiver, sender) for sender, receiver in kept}
    return [link for link in permutations(members, 2) if link not in kept]
