"""Which directed links a scenario means: `medium: sender -> receiver`, or `<->` for both directions.

Each of the three names may be a shell pattern (`*`, `?`, `[abc]`, case matters): `radio: * -> rover_[12]`. A name that
exists is taken literally. A link leads from one node to another one on the same medium, and to the node itself only
where the medium shows it to itself, as motion capture does. Where the medium is a pattern, media without such nodes are
passed over.

Not modelled: exceptions ("all but"), selection by anything else than names.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from fnmatch import fnmatchcase

from netem.core.link_name import LinkName

NOBODY: Mapping[str, Collection[str]] = {}
FORM = re.compile(r"\s*(?P<medium>[^:]+?)\s*:\s*(?P<sender>\S+?)\s*(?P<arrow><->|->)\s*(?P<receiver>\S+)\s*")


class LinkSelectorError(ValueError):
    """A link selection is malformed or selects no link."""


@dataclass(frozen=True)
class LinkSelector:
    text: str
    medium: str
    sender: str
    receiver: str
    both_ways: bool

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
        senders = self._matching("node", self.sender, nodes, where)
        receivers = self._matching("node", self.receiver, nodes, where)
        links = [(medium, sender, receiver) for sender in senders for receiver in receivers
                 if sender != receiver or sender in to_themselves]
        if not links:
            raise LinkSelectorError(f"{self.text!r}: a link leads to another node: name a receiver other than "
                                    f"{senders[0]!r} {where}")
        return links + [(medium, receiver, sender) for _, sender, receiver in links if self.both_ways]

    def _matching(self, kind: str, pattern: str, names: Collection[str], where: str) -> list[str]:
        if pattern in names:
            return [pattern]
        matching = [name for name in names if fnmatchcase(name, pattern)]
        if not matching:
            near = get_close_matches(pattern, names, 1, cutoff=0.5)
            remedy = f"nearest: {near[0]!r}" if near else f"expected one of {', '.join(names) or 'none'}"
            raise LinkSelectorError(f"{self.text!r}: {pattern!r} names no {kind} {where}: {remedy}")
        return matching


def parse(text: str) -> LinkSelector:
    form = FORM.fullmatch(text)
    if form is None:
        raise LinkSelectorError(f'{text!r}: expected "medium: sender -> receiver" or "medium: one <-> other"')
    return LinkSelector(text, form["medium"], form["sender"], form["receiver"], form["arrow"] == "<->")
