"""Where a robot learns the topology from: a kind with one Protocol, driven by the robot program.

`told_topology.py` knows it beforehand, `discovered_topology.py` floods the radio. All times are local nanoseconds.
"""

from __future__ import annotations

from typing import Protocol

from agents.synchronization.graph import Floats
from firmware_sim.schedules.slotted_broadcast import SlottedBroadcast


class TopologySource(Protocol):
    def heard_control(self, data: bytes, schedule: SlottedBroadcast, sent_ns: int) -> bool:
        """Bytes that are no sync frame were received, sent at `sent_ns` if they are a control frame; False if nobody
        can read them."""

    def before_own_slot(self, schedule: SlottedBroadcast, slot: int, heard: set[int]) -> None:
        """The robot is about to broadcast in slot number `slot`; it has heard outputs of `heard` since it did so last,
        one round ago."""

    def out_of_step(self) -> bool:
        """Whether what was heard shows that others count slots differently: the robot has to fall back."""

    def fell_back(self) -> None:
        """The robot uses the slots of the start again."""

    def wants_control(self, schedule: SlottedBroadcast, local_ns: int) -> bool:
        """Whether the robot is to use its next control sub-slot."""

    def control_frame(self, schedule: SlottedBroadcast, local_ns: int) -> bytes | None:
        """What to send in the control sub-slot that begins now."""

    def adoption_ns(self, schedule: SlottedBroadcast, local_ns: int) -> int | None:
        """The round end at which the robot has to call `adopt`, as far as it is known."""

    def adopt(self, at_ns: int) -> Floats | None:
        """The Laplacian that holds from now on, None if the old one stays."""
