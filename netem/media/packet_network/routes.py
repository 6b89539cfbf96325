"""Links, the shortest paths over switches, and the tree of links that a datagram takes to its receivers.

A path has the fewest links; among equals the one whose links the scenario names first. Nodes do not forward, switches
do. The paths of one sender form a tree, so a multicast datagram passes each of its links once and is copied where the
tree branches (a shortest-path tree for each source, as in Deering and Cheriton 1990).

Not modelled: routes that change, flooding while a switch learns addresses, costs other than the number of links.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from netem.core.drop_tail import DropTailQueue


@dataclass
class Link:
    """One direction of a link, from `tail` to `head`, with the queue at its tail."""

    tail: str
    head: str
    rate_bps: int
    delay_ns: int
    queue_packets: int
    queue_bytes: int | None
    mtu_bytes: int
    overhead_bytes: int
    sent: int = field(default=0, init=False)            # packets
    dropped: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        self.name = f"{self.tail} -> {self.head}"
        self.queue = DropTailQueue(self.rate_bps, self.queue_packets, self.queue_bytes)

    def take(self, size_bytes: int, now_ns: int) -> int | None:
        """Return the instant at which a packet that comes to the link now has been sent; None if it is dropped."""
        end_ns = self.queue.take(size_bytes + self.overhead_bytes, now_ns)
        if end_ns is None:
            self.dropped += 1
        else:
            self.sent += 1
        return end_ns

    def sending_ns(self, size_bytes: int) -> int:
        return self.queue.sending_ns(size_bytes + self.overhead_bytes)

    def idle_ns(self, size_bytes: int) -> int:
        """Return the time from a packet's first bit sent to its last bit received."""
        return self.sending_ns(size_bytes) + self.delay_ns


@dataclass
class Branch:
    """A link of a tree. If its head is a node, that is the only receiver; if it is a switch, `onward` goes on."""

    link: Link
    receivers: list[str] = field(default_factory=list)      # all behind this link
    onward: list[Branch] = field(default_factory=list)

    def rest_ns(self, size_bytes: int) -> int:
        """Return the least time of a packet from the head of this link to a receiver, over idle links."""
        return min([branch.link.idle_ns(size_bytes) + branch.rest_ns(size_bytes) for branch in self.onward], default=0)

    def mtu_bytes(self) -> int:
        return min([self.link.mtu_bytes, *(branch.mtu_bytes() for branch in self.onward)])


class Routes:
    def __init__(self, nodes: Sequence[str], switches: Sequence[str], links: Sequence[Link]) -> None:
        self.links = links
        self._out: dict[str, list[Link]] = {name: [] for name in (*nodes, *switches)}
        for link in links:
            self._out[link.tail].append(link)
        self._switches = frozenset(switches)
        self._last = {node: self._last_links(node) for node in nodes}   # by source: the last link of each path

    def reachable(self, source: str) -> list[str]:
        """Return the nodes to which there is a path from `source`, nearest first."""
        return [name for name in self._last[source] if name not in self._switches]

    def heard(self, node: str) -> bool:
        """Return whether there is a path from any node to `node`."""
        return any(node in last for source, last in self._last.items() if source != node)

    def tree(self, source: str, receivers: Iterable[str]) -> list[Branch]:
        """Return the first links of the paths from `source` to `receivers`, each with what lies behind it."""
        first: list[Branch] = []
        last = self._last[source]
        for receiver in receivers:
            path: list[Link] = []
            at = receiver
            while at != source:
                path.append(last[at])
                at = last[at].tail
            level = first
            for link in reversed(path):
                branch = next((found for found in level if found.link is link), None)
                if branch is None:
                    branch = Branch(link)
                    level.append(branch)
                branch.receivers.append(receiver)
                level = branch.onward
        return first

    def _last_links(self, source: str) -> dict[str, Link]:
        """Return the last link of the shortest path to each node and switch: breadth first, Moore 1959."""
        last: dict[str, Link] = {}
        waiting = deque([source])
        while waiting:
            at = waiting.popleft()
            for link in self._out[at]:
                if link.head != source and link.head not in last:
                    last[link.head] = link
                    if link.head in self._switches:
                        waiting.append(link.head)
        return last
