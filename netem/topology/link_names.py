"""Links by name: `a -> b` one way, `a <-> b` both ways; `*` and `?` match parts of node names, nobody hears itself."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from fnmatch import fnmatchcase

from netem.topology import Edge


def edges(link: str, nodes: Sequence[str]) -> tuple[list[Edge], list[str]]:
    """The edges that `link` names and what is wrong with it (empty: nothing)."""
    arrow = "<->" if "<->" in link else "->"
    left, found, right = (part.strip() for part in link.partition(arrow))
    if not found or not left or not right or "->" in right:
        return [], [f"link {link!r}: expected 'sender -> receiver' or 'node <-> node'"]
    problems = []
    ends = []
    for pattern in (left, right):
        matching = [node for node in nodes if fnmatchcase(node, pattern)]
        if not matching:
            near = get_close_matches(pattern, nodes, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"the nodes are {', '.join(nodes)}"
            problems.append(f"link {link!r}: no node is called {pattern!r}: {hint}")
        ends.append(matching)
    one_way = [(sender, receiver) for sender in ends[0] for receiver in ends[1] if sender != receiver]
    if not problems and not one_way and len(nodes) > 1:
        problems.append(f"link {link!r}: joins no two different nodes")
    return one_way + ([(receiver, sender) for sender, receiver in one_way] if arrow == "<->" else []), problems


def all_edges(links: Iterable[str], nodes: Sequence[str]) -> tuple[set[Edge], list[str]]:
    found: set[Edge] = set()
    problems: list[str] = []
    for link in links:
        some, wrong = edges(link, nodes)
        found.update(some)
        problems.extend(wrong)
    return found, problems
