"""Selects directed links by name: `medium: sender -> receiver`, or `<->` for both directions.

`link_pattern` has the grammar of the links, which join two nodes on one medium. A node has a link to itself only on a
medium that observes nodes for themselves, as motion capture does. If the medium is a pattern, as in
`*: * -> rover_[12]`, media without such nodes are skipped.

Not modelled: exceptions ("all but"), selection by anything else than names.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from netem.core import link_pattern
from netem.core.link_name import LinkName
from netem.core.link_pattern import LinkPattern
from netem.core.nearest import nearest

NOBODY: Mapping[str, Collection[str]] = {}


class LinkSelectorError(ValueError):
    """A link selection is malformed or selects no link."""


@dataclass(frozen=True)
class LinkSelector:
    text: str
    medium: str
    pattern: LinkPattern

    def resolve(self, nodes_on: Mapping[str, Collection[str]], to_themselves: Mapping[str, Collection[str]] = NOBODY,
                ) -> list[LinkName]:
        """Return the selected links without repetition, in the order of media and nodes.

        `nodes_on` maps each medium to its nodes, `to_themselves` to those that have a link to themselves. Raises
        `LinkSelectorError` if no link is selected.
        """
        media = self._matching("medium", self.medium, nodes_on, "of the scenario")
        links: dict[LinkName, None] = {}
        refusals: list[LinkSelectorError] = []
        for medium in media:
            try:
                links.update(dict.fromkeys(self._on(medium, nodes_on[medium], to_themselves.get(medium, ()))))
            except LinkSelectorError as refusal:
                refusals.append(refusal)
        if not links:
            raise refusals[0]
        return list(links)

    def _on(self, medium: str, nodes: Collection[str], to_themselves: Collection[str]) -> list[LinkName]:
        where = f"on medium {medium!r}"
        senders = self._matching("node", self.pattern.sender, nodes, where)
        receivers = self._matching("node", self.pattern.receiver, nodes, where)
        links = self.pattern.links(senders, receivers, to_themselves)
        if not links:
            raise LinkSelectorError(f"{self.text!r}: a link leads to another node: name a receiver other than "
                                    f"{senders[0]!r} {where}")
        return [(medium, sender, receiver) for sender, receiver in links]

    def _matching(self, kind: str, pattern: str, names: Collection[str], where: str) -> list[str]:
        found = link_pattern.matching(pattern, names)
        if not found:
            near = nearest(pattern, names)
            remedy = f"nearest: {near!r}" if near else f"expected one of {', '.join(names) or 'none'}"
            raise LinkSelectorError(f"{self.text!r}: {pattern!r} names no {kind} {where}: {remedy}")
        return found


def parse(text: str) -> LinkSelector:
    """Read a selection; raises `LinkSelectorError` for text of another form."""
    medium, _, links = text.partition(":")
    pattern = link_pattern.parse(links)
    if not medium.strip() or pattern is None:
        raise LinkSelectorError(f'{text!r}: expected "medium: sender -> receiver" or "medium: one <-> other"')
    return LinkSelector(text, medium.strip(), pattern)
