"""Topology discovery by flooding over directed links (section 6.3.1), as the state machine of one node.

    SILENT --trigger()--> ARMED --own control slot--> RUNNING --end cycle--> SILENT
    SILENT, ARMED or RUNNING --a frame of a newer epoch--> RUNNING

N nodes share control slots: in every cycle node i owns slot i, so discovery frames never collide, whatever the graph.
A node's record is the set of nodes whose frames it receives. While it runs, a node sends all records that it knows in
each of its slots, extends its own record, and merges the records that it receives.

End of a discovery. Let R = N^D + 1: of R successive frames on a link at least one arrives. A node k links away from the
first initiator sends from cycle start + k R on at the latest. As k <= N - 1, all send from start + (N - 1) R on, and by
start + N R every link has carried a frame: each node's own record is complete. N - 1 further links, at most R cycles
each, bring every record to every node. So all end together at start + (2N - 1) R, with the same complete graph, if the
graph was strongly connected and constant. Initiators of one epoch agree on the least start; it floods with the epoch.
If a silent node's driver evaluates received frames up to J cycles later, joining takes J more on each of N - 1 links.
In the last (N - 1) R cycles no node extends its own record: the extension would not reach all others.

Replaces the dissertation's reference [79]; here time is slotted, so the end is known and not inferred from silence.
Not modelled: frames longer than one radio payload. If links lose more than N^D frames in a row, the nodes may end
with different graphs; their driver has to detect that (`discovered_topology.py`).

Invariants:
- bytes that are no frame, or an impossible frame, change nothing but the counter `refused`;
- records only grow within an epoch;
- `outcome` changes only when an epoch ends or begins.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import lru_cache

from agents.synchronization.discovery_frame import MAX_BYTES, MAX_NODES, DiscoveryFrame, decode
from agents.synchronization.graph import Edge, Floats, laplacian_from_neighbours, unreachable_pairs

EPOCHS = 1 << 16


class Phase(Enum):
    SILENT = "silent"
    ARMED = "waits for its own control slot"
    RUNNING = "sends in each of its control slots"


@dataclass(frozen=True, eq=False)
class Topology:
    """The outcome of a discovery that found a strongly connected graph, the same at every node."""

    laplacian: Floats


@dataclass(frozen=True)
class Incomplete:
    """The outcome of a discovery that found no strongly connected graph."""

    heard_by: tuple[tuple[int, ...], ...]   # known records: heard_by[i] = nodes that i hears
    missing: tuple[int, ...]                # nodes without a known record
    cut_off: tuple[Edge, ...]               # pairs (i, j): no known path from i to j

    def __str__(self) -> str:
        """Return the reason in words; nodes are numbered from 1, as in the dissertation and in the records of a run."""
        if self.missing:
            missing = ", ".join(str(i + 1) for i in self.missing)
            return f"no record of node {missing}: it hears nobody, or nothing of it comes through (Assumption 7)"
        i, j = self.cut_off[0]
        return f"no path from node {i + 1} to node {j + 1}: the graph is not strongly connected (Assumption 7)"


def cycles_needed(nodes: int, max_successive_losses: int, join_delay_cycles: int = 0) -> int:
    """Return the cycles from the first frame of an epoch until every node knows the whole graph.

    That is (N^D + 1) (2N - 1) + J (N - 1)."""
    return (max_successive_losses + 1) * (2 * nodes - 1) + join_delay_cycles * (nodes - 1)


@lru_cache(maxsize=64)
def _outcome(records: tuple[int, ...]) -> Topology | Incomplete:
    """Return the outcome for the records of an epoch; cached, since a team meets few different graphs."""
    heard_by = tuple(tuple(j for j in range(len(records)) if record >> j & 1) for record in records)
    graph = laplacian_from_neighbours(heard_by)
    cut_off = unreachable_pairs(graph)
    missing = tuple(i for i, heard in enumerate(heard_by) if not heard)
    return Incomplete(heard_by, missing, tuple(cut_off)) if cut_off else Topology(graph)


class Discovery:
    """One node. `cycle` is the number of a control cycle: the current one or, in `hear`, that of the frame."""

    def __init__(self, node: int, size: int, max_successive_losses: int = 0, epoch: int = 0,
                 join_delay_cycles: int = 0) -> None:
        """`epoch` is that of the last discovery in which this node took part; after a restart any number will do.

        `join_delay_cycles`: the driver passes a frame that a silent node received in cycle c to `hear` before its
        control slot of cycle c + 1 + join_delay_cycles; to an armed or running node, before its next control slot.
        Raises ValueError for a number out of range.
        """
        if not 2 <= size <= MAX_NODES:
            raise ValueError(f"size={size}: expected 2 to {MAX_NODES}, what fits a frame of {MAX_BYTES} bytes")
        if not 0 <= node < size:
            raise ValueError(f"node={node}: nodes are numbered 0 to {size - 1}")
        if max_successive_losses < 0:
            raise ValueError(f"max_successive_losses={max_successive_losses}: expected 0 or more")
        if join_delay_cycles < 0:
            raise ValueError(f"join_delay_cycles={join_delay_cycles}: expected 0 or more")
        if not 0 <= epoch < EPOCHS:
            raise ValueError(f"epoch={epoch}: expected 0 to {EPOCHS - 1}")
        self.node = node
        self.size = size
        self.cycles = cycles_needed(size, max_successive_losses, join_delay_cycles)
        self._flood_cycles = (size - 1) * (max_successive_losses + 1)
        self.phase = Phase.SILENT
        self.epoch = epoch
        self.start_cycle = -self.cycles
        self.records = [0] * size               # bit j of records[i]: i hears j
        self.outcome: Topology | Incomplete | None = None
        self.refused = 0                        # number of inputs of `hear` that were no possible frame

    @property
    def is_running(self) -> bool:
        return self.phase is Phase.RUNNING

    @property
    def end_cycle(self) -> int:
        """The first cycle after the epoch, the same at all nodes."""
        return self.start_cycle + self.cycles

    def trigger(self, cycle: int) -> None:
        """Start a new discovery; without effect while one runs or is about to."""
        self._end_if_due(cycle)
        if self.phase is Phase.SILENT:
            self.phase = Phase.ARMED

    def abandon(self) -> None:
        """Drop the running epoch, when cycles are counted anew; begin a new one at the next own control slot."""
        self.phase = Phase.ARMED
        self.outcome = None

    def fits(self, frame: DiscoveryFrame, owner: int, cycle: int) -> bool:
        """Return whether a frame in the control slot of `owner` can be from a node that counts slots alike."""
        return frame.sender == owner and frame.start_cycle <= cycle < frame.start_cycle + self.cycles

    def frame_to_send(self, cycle: int) -> bytes | None:
        """Return the frame to send in this node's control slot of `cycle`; None: send nothing."""
        self._end_if_due(cycle)
        if self.phase is Phase.ARMED:
            self._join((self.epoch + 1) % EPOCHS, cycle)
        if self.phase is Phase.SILENT:
            return None
        return DiscoveryFrame(self.node, self.epoch, self.start_cycle, tuple(self.records)).encode()

    def hear(self, sender: int, data: bytes, cycle: int) -> bool:
        """Apply bytes received in `cycle` in the control slot of `sender`; return whether the running epoch's."""
        self._end_if_due(cycle)
        frame = decode(data, self.size)
        if frame is None or sender == self.node or not self.fits(frame, sender, cycle):
            self.refused += 1
            return False
        if self._is_newer(frame.epoch):
            self._join(frame.epoch, frame.start_cycle)
        elif frame.epoch != self.epoch or not self.is_running:
            self.refused += 1
            if frame.epoch != self.epoch or frame.start_cycle > self.start_cycle:
                self.trigger(cycle)     # the sender restarted or was out of reach: a newer epoch includes it
            return False
        self.start_cycle = min(self.start_cycle, frame.start_cycle)
        for node, record in enumerate(frame.records):
            if node != self.node:
                self.records[node] |= record
        if cycle < self.end_cycle - self._flood_cycles:     # a later change would not reach all nodes
            self.records[self.node] |= 1 << sender
        return True

    def finish(self, cycle: int) -> Topology | Incomplete:
        """Return the outcome of the last epoch; RuntimeError before `end_cycle`."""
        self._end_if_due(cycle)
        if self.outcome is None:
            raise RuntimeError(f"node {self.node}: no discovery has ended by cycle {cycle} "
                               f"({self.phase.name}, end_cycle={self.end_cycle})")
        return self.outcome

    def _is_newer(self, epoch: int) -> bool:
        return 0 < (epoch - self.epoch) % EPOCHS < EPOCHS // 2

    def _join(self, epoch: int, start_cycle: int) -> None:
        self.phase = Phase.RUNNING
        self.epoch = epoch
        self.start_cycle = start_cycle
        self.records = [0] * self.size
        self.outcome = None

    def _end_if_due(self, cycle: int) -> None:
        if not self.is_running or cycle < self.end_cycle:
            return
        self.phase = Phase.SILENT
        self.outcome = _outcome(tuple(self.records))
