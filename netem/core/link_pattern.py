"""`sender -> receiver`, or `one <-> other` for both directions: the grammar of links, wherever a scenario names them.

Each name may be a shell pattern (`*`, `?`, `[abc]`, case matters); a name that exists is taken literally. A link leads
from one node to another one.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from fnmatch import fnmatchcase
from typing import NamedTuple

_FORM = re.compile(r"\s*(?P<sender>\S+?)\s*(?P<arrow><->|->)\s*(?P<receiver>(?:(?!->)\S)+)\s*")


class LinkPattern(NamedTuple):
    sender: str
    receiver: str
    both_ways: bool

    def links(self, senders: Iterable[str], receivers: Collection[str],
              to_themselves: Collection[str] = ()) -> list[tuple[str, str]]:
        """(sender, receiver) between nodes that match; `to_themselves`: those with a link to themselves."""
        found = [(sender, receiver) for sender in senders for receiver in receivers
                 if sender != receiver or sender in to_themselves]
        return found + [(receiver, sender) for sender, receiver in found if self.both_ways]


def parse(text: str) -> LinkPattern | None:
    """None if the text names no link."""
    form = _FORM.fullmatch(text)
    return None if form is None else LinkPattern(form["sender"], form["receiver"], form["arrow"] == "<->")


def matching(pattern: str, names: Collection[str]) -> list[str]:
    return [pattern] if pattern in names else [name for name in names if fnmatchcase(name, pattern)]
