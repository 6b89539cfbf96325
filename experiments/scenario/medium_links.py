"""The directed links that a medium has at some time of a run."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any


def medium_links(medium: Any, settings: Any, nodes: Collection[str], length_ns: int) -> list[tuple[str, str]]:
    """(sender, receiver) for every link of its topology over [0, length_ns); of a medium without one, all pairs, and
    to themselves the nodes that it shows to themselves."""
    everyone = [(sender, receiver) for sender in nodes for receiver in nodes if sender != receiver]
    topology = getattr(medium, "topology", None)
    if topology is None:
        return everyone + [(node, node) for node in getattr(settings, "fixed_cameras", ())]
    found: set[tuple[str, str]] = set()
    for at_ns in [0, *topology.changes_ns(length_ns)]:
        found.update(topology.graph_at(at_ns))
        if len(found) == len(everyone):
            break
    return [link for link in everyone if link in found]
