"""A mobile hybrid network as data (Definition 3), and its graphs over an interval, from what a run recorded.

    Sigma = (I, A, G_c, G_s, G_h)

    I, A    `Network.nodes`, `Network.automata`         G_c   who heard whom: a frame of one was delivered to the other
    G_h     who acted on whom: the changes of mode      G_s   who saw whom: a sight of one was delivered to the other
            that name a cause `by` another node, and the edges of `Network.control`

An edge leads from the node that the information is about to the node that has it. An edge of G_h needs one of G_c or
G_s; `missing_contacts` refuses it otherwise.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from agents.hybrid.automaton import Automaton
from agents.hybrid.checker import Refusal, Rule
from agents.hybrid.mode_change import ModeChange
from netem.wire.instants import NEVER_NS

if TYPE_CHECKING:
    import networkx as nx

Pair = tuple[str, str]                                  # from, to
Instants = Mapping[Pair, NDArray[np.int64]]             # increasing, in ns


@dataclass(frozen=True)
class Contacts:
    """The instants at which frames and sights were delivered, by (from, to)."""

    heard: Instants = field(default_factory=dict)
    seen: Instants = field(default_factory=dict)

    def between(self, pair: Pair, after_ns: int, until_ns: int) -> bool:
        """Return whether anything passed from the first of the pair to the second in (after_ns, until_ns]."""
        return any(_any(instants.get(pair), after_ns + 1, until_ns + 1) for instants in (self.heard, self.seen))


@dataclass(frozen=True)
class Network:
    """All nodes, the automata of those that declare one, and the pairs (controller, controlled) that the design demands
    at all times.
    """

    nodes: tuple[str, ...]
    automata: Mapping[str, Automaton] = field(default_factory=dict)
    control: frozenset[Pair] = frozenset()

    def __post_init__(self) -> None:
        named = {name for pair in self.control for name in pair} | self.automata.keys()
        if unknown := sorted(named - set(self.nodes)):
            raise ValueError(f"{', '.join(unknown)}: expected nodes of the network, {', '.join(self.nodes)}")

    @property
    def uniform(self) -> bool:
        """True if all nodes have the same automaton; else the network is heterogeneous."""
        automata = [self.automata.get(node) for node in self.nodes]
        return all(automaton == automata[0] for automaton in automata)


@dataclass(frozen=True)
class Graphs:
    """The graphs over [from_ns, until_ns); every node of the network is in each, and who else took part."""

    from_ns: int
    until_ns: int
    communication: nx.DiGraph
    sensing: nx.DiGraph
    control: nx.DiGraph

    def unsupported(self) -> list[Pair]:
        """Return the edges of the control graph that have neither a communication nor a sensing edge."""
        import networkx as nx

        return sorted(nx.difference(self.control, nx.compose(self.communication, self.sensing)).edges)


def graphs(network: Network, contacts: Contacts, changes: Sequence[ModeChange], period_ns: int,
           length_ns: int) -> Iterator[Graphs]:
    """Yield the graphs of each interval [k period_ns, (k + 1) period_ns) of a run; ValueError for a period below 1."""
    import networkx as nx

    if period_ns < 1:
        raise ValueError(f"period_ns={period_ns}: expected at least 1")
    for from_ns in range(0, length_ns, period_ns):
        until_ns = min(from_ns + period_ns, length_ns)
        acted = {(change.by, change.node) for change in changes
                 if change.by and from_ns <= change.time_ns < until_ns}
        built = []
        for edges in (_during(contacts.heard, from_ns, until_ns), _during(contacts.seen, from_ns, until_ns),
                      network.control | acted):
            graph = nx.DiGraph()
            graph.add_nodes_from(network.nodes)
            graph.add_edges_from(edges)
            built.append(graph)
        yield Graphs(from_ns, until_ns, *built)


def missing_contacts(changes: Sequence[ModeChange], contacts: Contacts, within_ns: int = NEVER_NS) -> Iterator[Refusal]:
    """Refuse each change of mode by a node of which no frame and no sight came in the last `within_ns` before it."""
    for change in changes:
        if change.by in ("", change.node):
            continue
        after_ns = max(-1, change.time_ns - within_ns)
        if not contacts.between((change.by, change.node), after_ns, change.time_ns):
            span = "before it" if after_ns < 0 else f"in the {within_ns} ns before it"
            yield Refusal(change.node, Rule.CONTROL, change.time_ns, change.time_ns,
                          f"{change.before} -> {change.after} by {change.by}: it neither heard nor saw {change.by} "
                          f"{span}")


def _during(instants: Instants, from_ns: int, until_ns: int) -> set[Pair]:
    return {pair for pair, found in instants.items() if _any(found, from_ns, until_ns)}


def _any(found: NDArray[np.int64] | None, from_ns: int, until_ns: int) -> bool:
    """Return whether one of the instants is in [from_ns, until_ns)."""
    if found is None:
        return False
    first, end = np.searchsorted(found, [from_ns, until_ns])
    return bool(first < end)
