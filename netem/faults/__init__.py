"""Faults: timed changes to the world of a run, such as a node that is killed or a link that is cut.

A member of this kind is a frozen dataclass whose fields are its TOML keys. What every fault has besides, `on`, `name`
and when it occurs, is not among them (schedule.py). A member has one verb, `strike`: it tells the world ahead what
happens at one occurrence. Faults compose: two that cut the same link both have to end before it carries frames again.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from itertools import permutations
from typing import Any, ClassVar, NamedTuple, Protocol

from netem.core import link_pattern, link_selector
from netem.core.link_name import LinkName
from netem.core.nearest import nearest
from netem.core.windows import Windows
from netem.faults.candidates import Candidate
from netem.faults.schedule import Occurrence

Target = tuple[str, ...]        # (node,), (medium,) or (medium, sender, receiver)


class PlantFace(Protocol):
    """What a fault asks of a robot's plant before the run."""

    def refusal_of_change(self, variable: str, *, inputs_only: bool, scaled: bool, value: Any) -> str:
        """Return why `variable` cannot be changed while the plant runs, "" if it can.

        `scaled` asks for a change of the present value, else `value` is what it gets, None for any.
        """

    def scalable(self) -> Mapping[str, bool]:
        """Return the variables that a fault can scale while the plant runs, each with whether it is an input."""


class Site(NamedTuple):
    """The names that a fault can be about."""

    nodes: Collection[str]                              # robots, without gateways
    nodes_on: Mapping[str, Collection[str]]             # by medium
    to_themselves: Mapping[str, Collection[str]]        # by medium: nodes with a link to themselves
    plants: Mapping[str, PlantFace] = {}                # by robot, of those that have one
    timed: Collection[str] = ()                         # robots whose programs have execution times
    strikable: Mapping[str, Collection[str]] = {}       # by medium: the parts that faults strike, links if not told
    located: Mapping[str, Collection[str]] = {}         # by medium: nodes whose position it knows
    links: Collection[LinkName] | None = None           # those that carry frames; None: every pair of nodes


class World(Protocol):
    """What a fault can do to a run. Instants are true time [ns]."""

    def at(self, time_ns: int, action: Callable[[], None]) -> None:
        """Call `action` before everything else at `time_ns`; nothing happens there if the run ends before."""

    def kill(self, node: str, boots_ns: int, fields: Mapping[str, Any], cause: str) -> None:
        """In an action: end the node, which boots at `boots_ns`, at NEVER_NS not at all."""

    def pause(self, node: str, until_ns: int, depth: int, cause: str) -> None:
        """In an action: let the node stand still; `depth` frames of each medium wait in its receive buffer."""

    def in_node(self, node: str, kind: str, fields: Mapping[str, Any]) -> None:
        """In an action: let a fault act within the node."""

    def on_medium(self, target: Target, how: str, cause: str, fields: Mapping[str, Any],
                  occurrence: Occurrence) -> None:
        """Let a medium fail, in a way `how` of its own, before the occurrence or, in an action, at its start."""

    def cut(self, link: LinkName, cause: str, spares_under_way: bool) -> Windows:
        """Return the windows in which `cause` cuts the link, to add one that has not begun.

        With `spares_under_way` it does not cut copies that their medium has passed to the link before the window.
        """

    def flip(self, link: LinkName, cause: str, ratio: float, flipped_bits: int, spares_under_way: bool) -> Windows:
        """Return the windows in which `cause` flips bits on the link that no checksum finds; see `cut`."""


class Fault:
    """Base class of a member, with answers that have defaults."""

    on: ClassVar[str] = "nodes"             # what the key `on` selects: nodes, media or links
    strikes: ClassVar[str] = "links"        # part of a medium, if any: links, channel, ...
    needs: ClassVar[str] = "a node"         # what a scenario has that can take it, for people
    lasting: ClassVar[bool] = True          # whether an occurrence has an end, else it is an instant
    kills: ClassVar[bool] = False           # whether it may end a node's process
    cuts: ClassVar[bool] = False            # whether it cuts links, and takes the key `spares_under_way`
    flips: ClassVar[bool] = False           # whether it changes copies on links, drawn while it acts, and takes it too
    away: ClassVar[bool] = False            # whether its nodes do not receive during an occurrence
    unset: ClassVar[Mapping[str, str]] = {}     # by field whose default is None: the meaning of that, for people

    def resolve(self, on: str, site: Site) -> list[Target]:
        """Return what `on` selects; ValueError for text of another form, or that selects nothing."""
        if self.on == "links":
            return list(link_selector.parse(on).resolve(site.nodes_on, site.to_themselves))
        names = site.nodes if self.on == "nodes" else site.nodes_on
        found = link_pattern.matching(on, names)
        if not found:
            near = nearest(on, names)
            raise ValueError(f"{on!r} names no {'node' if self.on == 'nodes' else 'medium'} of the scenario: "
                             + (f"nearest: {near!r}" if near else f"expected one of {', '.join(names) or 'none'}"))
        return [(name,) for name in found]

    @classmethod
    def targets(cls, site: Site) -> list[str]:
        """Return a text for `on` for each single node, medium or link that can take the fault."""
        if cls.on == "nodes":
            return list(site.nodes)
        media = {medium: nodes for medium, nodes in site.nodes_on.items()
                 if len(nodes) > 1 and cls.strikes in site.strikable.get(medium, ("links",))}
        if cls.on == "media":
            return list(media)
        links = [(medium, *pair) for medium, nodes in media.items() for pair in permutations(nodes, 2)] \
            if site.links is None else [link for link in site.links if link[0] in media]
        return [f"{medium}: {sender} -> {receiver}" for medium, sender, receiver in links]

    @classmethod
    def candidates(cls, site: Site) -> list[Candidate]:
        """Return what a search may draw of this kind, nothing if nothing there can take it.

        The default is every target, with the fields at their defaults.
        """
        return [Candidate(on) for on in cls.targets(site)]

    def refusal(self, target: Target, site: Site) -> str:
        """Return why the fault cannot act on `target`, as `key=value: rule` if a key is wrong; "" if it can."""
        return ""

    @staticmethod
    def on_nodes(patterns: Sequence[str], medium: str, nodes: Collection[str], key: str) -> list[str]:
        """Return the nodes of a medium that the patterns under `key` name; ValueError for one that names none."""
        found: list[str] = []
        for pattern in patterns:
            names = link_pattern.matching(pattern, nodes)
            if not names:
                near = nearest(pattern, nodes)
                raise ValueError(f"{key}: {pattern!r} names no node on medium {medium!r}: "
                                 + (f"nearest: {near!r}" if near else f"expected one of {', '.join(nodes)}"))
            found += [name for name in names if name not in found]
        return found

    def acts_again(self) -> bool:
        """Return whether it acts in a run that meets recorded fates, as these do not hold all that it does."""
        return self.on == "nodes" or self.strikes != "links"

    def until_ns(self, occurrence: Occurrence) -> int:
        """Return the end of the fault's effect [ns], NEVER_NS for that of the run."""
        return occurrence.end_ns

    def strike(self, world: World, cause: str, targets: Sequence[Target], occurrence: Occurrence) -> None:
        """Tell the world what happens at this occurrence. `cause` names the fault in the ledger."""
        raise NotImplementedError
