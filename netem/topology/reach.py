"""The nodes that a frame of one sender reaches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Reach:
    """The nodes that a frame of one sender reaches.

    - `receivers`: intended receivers, for each of which the ledger has a copy, in the order of the nodes;
    - `in_range`: receivers that can decode the frame and sense its carrier; under `radio_network` they lose what it
      overlaps;
    - `too_weak`: receivers that are not in range;
    - `cut`: those of them that are not because a fault stops the carrier, with its cause; the fate of their copies;
    - `rx_dbm`: received power at every node that gets any, intended receiver or not;
    - `delays_ns`: propagation time to every node of `rx_dbm`; empty if a frame arrives everywhere at once.
    """

    receivers: tuple[str, ...]
    in_range: frozenset[str]
    too_weak: frozenset[str]
    rx_dbm: Mapping[str, float]
    delays_ns: Mapping[str, int] = field(default_factory=dict)
    cut: Mapping[str, str] = field(default_factory=dict)
