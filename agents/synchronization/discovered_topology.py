"""A topology source that discovers the topology over the radio, whenever received frames contradict the known one.

A contradiction is a frame of a neighbour missing N^D + 1 times in a row in its slot, or a frame from a robot that is no
neighbour. It starts the flooding of `discovery.py` in the control sub-slots; the robot adopts the result at the first
end of a round after the flooding's common end.

Right after an adoption frames are still on their way. So a robot counts a frame as missing only when even the slowest
first frames of the new schedule have arrived.

A robot evaluates the frames that it received only when it wakes for a slot of its own: that keeps its promise of
silence firm. So it may join a discovery one cycle later than `discovery.py` assumes, at each of at most N - 1 links.

Differs from the dissertation: Delta_u is not neglected; the old topology holds while the new one is discovered.
If a discovery ends without the whole graph, or a control frame arrives in a slot that is not its sender's, the robots
use different schedules. Then the robot falls back to the slots of the start, which are the same for all, and begins a
new discovery there.
"""

from __future__ import annotations

from typing import Final

from agents.synchronization.discovery import Discovery, Incomplete, Phase
from agents.synchronization.discovery_frame import decode
from agents.synchronization.graph import Floats, neighbours
from firmware_sim.board import Board
from firmware_sim.schedules.slotted_broadcast import SlottedBroadcast

COUNTERS: Final = ("discoveries started", "incomplete discoveries", "refused control frames")


class DiscoveredTopology:
    """Begins with a discovery, since no robot knows the topology at the start."""

    def __init__(self, board: Board, number: int, robots: int, max_successive_losses: int,
                 oldest_value_ns: int) -> None:
        self._board = board
        self._number = number
        self._robots = robots
        self._losses = max_successive_losses
        self._oldest_value_ns = oldest_value_ns             # negative: unknown
        self._discovery = Discovery(number, robots, max_successive_losses, join_delay_cycles=1)
        self._discovery.trigger(0)
        self._inbox: list[tuple[int, bytes, int]] = []      # (owner of the control slot, bytes, cycle)
        self._neighbours: frozenset[int] = frozenset()
        self._missed: dict[int, int] = {}                   # neighbour -> slots in a row without its frame
        self._own_slots = 0                                 # since the schedule is in force
        self._adopts = False
        self._out_of_step = False                           # a control frame arrived in a slot not its sender's
        for counter in COUNTERS:
            board.count(counter, 0)

    def heard_control(self, data: bytes, schedule: SlottedBroadcast, sent_ns: int) -> bool:
        slot = schedule.slot_at(sent_ns).number
        if slot < 0:
            return False
        owner, cycle = schedule.control_owner(slot), schedule.control_cycle(slot)
        frame = decode(data, self._robots)
        if frame is not None and not self._discovery.fits(frame, owner, cycle):
            self._out_of_step = True
        self._inbox.append((owner, data, cycle))
        return True

    def before_own_slot(self, schedule: SlottedBroadcast, slot: int, heard: set[int]) -> None:
        if self._inbox:
            self._read_inbox()
        if heard == self._neighbours:
            if self._missed:
                self._missed.clear()
        elif self._discovery.phase is Phase.SILENT and not self._adopts and self._neighbours and (
                reason := self._event(heard, schedule)):
            self._board.event("topology changed", reason)
            self._discovery.trigger(schedule.control_cycle(slot))
        self._own_slots += 1

    def out_of_step(self) -> bool:
        return self._out_of_step

    def fell_back(self) -> None:
        self._inbox.clear()
        self._missed.clear()
        self._out_of_step = self._adopts = False
        self._own_slots = 0
        self._discovery.abandon()

    def wants_control(self, schedule: SlottedBroadcast, local_ns: int) -> bool:
        return self._discovery.phase is not Phase.SILENT

    def control_frame(self, schedule: SlottedBroadcast, local_ns: int) -> bytes | None:
        self._read_inbox()
        started = self._discovery.phase is Phase.ARMED
        frame = self._discovery.frame_to_send(schedule.control_cycle(schedule.slot_at(local_ns).number))
        if frame is not None and started:
            self._board.count("discoveries started")
        self._adopts = self._adopts or self._discovery.is_running
        return frame

    def adoption_ns(self, schedule: SlottedBroadcast, local_ns: int) -> int | None:
        if not self._adopts:
            return None
        return schedule.round_end_after(schedule.slot(self._discovery.end_cycle * self._robots).start_ns - 1)

    def adopt(self, at_ns: int) -> Floats | None:
        self._read_inbox()
        self._adopts = False
        self._own_slots = 0
        self._missed.clear()
        outcome = self._discovery.finish(self._discovery.end_cycle)
        if isinstance(outcome, Incomplete):
            self._board.count("incomplete discoveries")
            self._board.warn("incomplete discovery", str(outcome))
            return None
        self._neighbours = frozenset(neighbours(outcome.laplacian)[self._number])
        return outcome.laplacian

    def _read_inbox(self) -> None:
        for owner, data, cycle in self._inbox:
            if not self._discovery.hear(owner, data, cycle):
                self._board.count("refused control frames")
        self._inbox.clear()
        self._adopts = self._adopts or self._discovery.is_running

    def _event(self, heard: set[int], schedule: SlottedBroadcast) -> str:
        """Return why the topology must have changed, "" if no received frame contradicts it."""
        for sender in sorted(heard - self._neighbours):
            return f"robot {self._number + 1} hears robot {sender + 1}, which is no neighbour"
        if self._all_due(schedule):
            for sender in sorted(self._neighbours):
                missed = 0 if sender in heard else self._missed.get(sender, 0) + 1
                self._missed[sender] = missed
                if missed > self._losses:
                    return (f"robot {self._number + 1} missed the frame of robot {sender + 1} in its slot"
                            + (f" {missed} times in a row" if missed > 1 else ""))
        return ""

    def _all_due(self, schedule: SlottedBroadcast) -> bool:
        """Return whether a frame of each neighbour has come since the last own slot unless it is lost.

        True in the own slot after the k-th of a schedule if each value arrives in less than k - 1 rounds and a slot."""
        k = self._own_slots
        return k > 0 and self._oldest_value_ns < ((k - 1) * schedule.parts + 1) * schedule.slot_ns
