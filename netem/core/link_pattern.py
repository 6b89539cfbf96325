"""The grammar of links in scenarios: `sender -> receiver`, or `one <-> other` for both directions.

Each name may be a shell pattern (`*`, `?`, `[abc]`, case-sensitive); the name of an existing node is taken literally.
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
        """Return (sender, receiver) pairs of different nodes, and of one node if it is in `to_themselves`."""
        found = [(sender, receiver) for sender in senders for receiver in receivers
                 if sender != receiver or sender in to_themselves]
        return found + [(receiver, sender) for sender, receiver in found if self.both_ways]


def parse(text: str) -> LinkPattern | None:
    """Return the pattern in `text`, None if the text has another form."""
    form = _FORM.fullmatch(text)
    return None if form is None else LinkPattern(form["sender"], form["receiver"], form["arrow"] == "<->")


def matching(pattern: str, names: Collection[str]) -> list[str]:
    """Return the name `pattern` if it exists, else the names that match it as a shell pattern."""
    return [pattern] if pattern in names else [name for name in names if fnmatchcase(name, pattern)]
