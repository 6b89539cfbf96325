"""Resolves `on` of a guarantee: the links, senders, signals, events or executions that a monitor watches.

Names may be shell patterns, as in a link selector. `radio: * -> *` means the links that exist at some time of the run;
a link that is named but never exists is a mistake, as the monitor could not judge it.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from enum import Enum

from netem.core import link_selector
from netem.core.link_name import LinkName
from netem.core.link_pattern import matching
from netem.core.nearest import nearest

Subject = tuple[str, ...]


class Named(Enum):
    """The forms of `on` in a guarantee; the comment gives the tuple of one subject."""

    LINKS = "medium: sender -> receiver"        # (medium, sender, receiver)
    SENDERS = "medium: node"                    # (medium, node)
    SIGNALS = "node.signal"                     # (node, signal)
    EVENTS = "node.kind of event"               # (node, kind)
    FORMULA = "formula"                         # (formula,), then (selector, medium, sender, receiver) for each link
    SIGHTS = "medium: target -> observer"       # (sensing medium, body, observer)
    EXECUTIONS = "node"                         # (node,)


def formula_subjects(formula: str, links: Mapping[str, Sequence[LinkName]]) -> list[Subject]:
    """Return a formula, with the links of each selector in it, as the subjects of a guarantee."""
    return [(formula,), *((selector, *link) for selector, found in links.items() for link in found)]


def links_in_formula(subjects: Sequence[Subject]) -> tuple[str, dict[str, list[LinkName]]]:
    """Return the formula and the links that `formula_subjects` made subjects of."""
    (formula,), *links = subjects
    found: dict[str, list[LinkName]] = {}
    for selector, medium, sender, receiver in links:
        found.setdefault(selector, []).append((medium, sender, receiver))
    return formula, found


_SENDER = re.compile(r"\s*(?P<medium>[^:]+?)\s*:\s*(?P<node>\S+)\s*")


def subjects_of(named: Named, on: str, nodes_on: Mapping[str, Sequence[str]], links: Collection[LinkName],
                reporting: Collection[str]) -> list[Subject]:
    """Return the subjects that `on` names; ValueError with the reason if it names none.

    `nodes_on` are the nodes by medium, `links` those that exist at some time of the run, `reporting` the nodes and the
    tables of derived signals; for executions the agents whose programs declare an automaton.
    """
    if named is Named.LINKS:
        return _links(on, nodes_on, links, "link")
    if named is Named.SIGHTS:
        return _links(on, nodes_on, links, "pair of a body and its observer on a sensing medium")
    if named is Named.SENDERS:
        return _senders(on, nodes_on)
    if named is Named.EXECUTIONS:
        return [(found,) for found in _matching("agent whose program declares an automaton", on, reporting)]
    node, dot, name = on.partition(".")
    if not node or not dot or not name:
        raise ValueError(f'expected "{named.value}"')
    return [(found, name) for found in _matching("node", node, reporting)]


def _links(on: str, nodes_on: Mapping[str, Sequence[str]], links: Collection[LinkName], what: str) -> list[Subject]:
    to_themselves = {medium: [sender for each, sender, receiver in links if each == medium and sender == receiver]
                     for medium in nodes_on}
    selected = link_selector.parse(on).resolve(nodes_on, to_themselves)
    there = [link for link in selected if link in set(links)]
    if not there:
        known = [f"{medium}: {sender} -> {receiver}" for medium, sender, receiver in links]
        raise ValueError(f"no such {what} at any time of the run; {_nearest(on, known)}")
    return list(there)


def _senders(on: str, nodes_on: Mapping[str, Sequence[str]]) -> list[Subject]:
    form = _SENDER.fullmatch(on)
    if form is None:
        raise ValueError(f'expected "{Named.SENDERS.value}"')
    media = _matching("medium", form["medium"], nodes_on)
    there = list(dict.fromkeys(node for medium in media for node in nodes_on[medium]))
    nodes = _matching("node on that medium", form["node"], there)
    return [(medium, node) for medium in media for node in nodes if node in nodes_on[medium]]


def _matching(kind: str, pattern: str, names: Collection[str]) -> list[str]:
    found = matching(pattern, names)
    if not found:
        raise ValueError(f"{pattern!r} names no {kind}; {_nearest(pattern, names)}")
    return found


def _nearest(word: str, names: Collection[str]) -> str:
    close = nearest(word, names)
    return f"nearest: {close!r}" if close else f"expected one of {', '.join(names) or 'none'}"
