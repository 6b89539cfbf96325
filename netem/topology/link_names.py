"""Reads and writes links of a topology, in the grammar of `netem.core.link_pattern`; no link joins a node to itself."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from netem.core.link_pattern import matching, parse
from netem.core.nearest import did_you_mean
from netem.topology import Edge


def edges(link: str, nodes: Sequence[str]) -> tuple[list[Edge], list[str]]:
    """Return the edges that `link` names, and the problems found in it."""
    pattern = parse(link)
    if pattern is None:
        return [], [f"link {link!r}: expected 'sender -> receiver' or 'node <-> node'"]
    ends = {name: matching(name, nodes) for name in (pattern.sender, pattern.receiver)}
    all_nodes = f"the nodes are {', '.join(nodes)}"
    problems = [f"link {link!r}: no node is called {name!r}: {did_you_mean(name, nodes, all_nodes)}"
                for name, there in ends.items() if not there]
    found = pattern.links(ends[pattern.sender], ends[pattern.receiver])
    if not problems and not found and len(nodes) > 1:
        problems.append(f"link {link!r}: joins no two different nodes")
    return found, problems


def all_edges(links: Iterable[str], nodes: Sequence[str]) -> tuple[set[Edge], list[str]]:
    """Return the edges of all links, and the problems found in them."""
    found: set[Edge] = set()
    problems: list[str] = []
    for link in links:
        some, wrong = edges(link, nodes)
        found.update(some)
        problems.extend(wrong)
    return found, problems


def in_words(links: Sequence[Edge]) -> str:
    """Return the links as text that `all_edges` reads, "a -> b, b <-> c"."""
    left = {*links}
    names = []
    for sender, receiver in links:
        if (sender, receiver) in left:
            both = (receiver, sender) in left
            names.append(f"{sender} {'<->' if both else '->'} {receiver}")
            left -= {(sender, receiver), (receiver, sender)}
    return ", ".join(names)
