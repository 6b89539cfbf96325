"""A topology source with topologies known beforehand, each from some time on; adopted at the next end of a round.

Section 6.3.1 with Delta_u = 0: discovery takes no time.
Differs from the dissertation: a new topology waits for the end of the round, so that every robot can broadcast
(`starving`; NUMBERS, Chapter 6, repair 7).
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from agents.synchronization.graph import Floats
from agents.synchronization.topology_source import TopologySource
from firmware_sim.schedules.slotted_broadcast import SlottedBroadcast


class ToldTopology(TopologySource):
    """`requests` are (from_ns, Laplacian), ascending from 0; with `repeat_ns` they repeat with that period."""

    def __init__(self, requests: Sequence[tuple[int, Floats]], repeat_ns: int = 0) -> None:
        instants = [at for at, _ in requests]
        if instants[:1] != [0] or any(earlier >= later for earlier, later in pairwise(instants)):
            raise ValueError(f"requests at {instants} ns: expected ascending instants from 0")
        if repeat_ns and repeat_ns <= instants[-1]:
            raise ValueError(f"repeat_ns={repeat_ns}: expected more than the last request's {instants[-1]} ns")
        self._instants = instants
        self._laplacians = [laplacian for _, laplacian in requests]
        self._repeat_ns = repeat_ns
        self.current = self._laplacians[0]

    def requested(self, local_ns: int) -> Floats:
        since_ns = local_ns % self._repeat_ns if self._repeat_ns else local_ns
        return self._laplacians[max(0, bisect_right(self._instants, since_ns) - 1)]

    def adoption_ns(self, schedule: SlottedBroadcast, local_ns: int) -> int | None:
        end_ns = schedule.round_end_after(local_ns)
        return None if np.array_equal(self.requested(end_ns), self.current) else end_ns

    def adopt(self, at_ns: int) -> Floats | None:
        self.current = self.requested(at_ns)
        return self.current
