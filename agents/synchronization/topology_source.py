"""Sources of the topology: a kind with one Protocol, whose methods the robot program calls.

`told_topology.py` knows the topology beforehand, `discovered_topology.py` floods the radio. All times are local [ns].
The methods about control frames have defaults for a source that sends none.
"""

from __future__ import annotations

from typing import Protocol

from agents.synchronization.graph import Floats
from firmware_sim.schedules.slotted_broadcast import SlottedBroadcast


class TopologySource(Protocol):
    def heard_control(self, data: bytes, schedule: SlottedBroadcast, sent_ns: int) -> bool:
        """Take received bytes that are no sync frame, sent at `sent_ns` if they are a control frame.

        Returns False if they are unreadable."""
        return False

    def before_own_slot(self, schedule: SlottedBroadcast, slot: int, heard: set[int]) -> None:
        """Called before the robot broadcasts in slot number `slot`; `heard` are the robots whose outputs it received
        since its last slot, one round ago."""
        return

    def out_of_step(self) -> bool:
        """Return whether received frames show that others count slots differently; the robot then falls back."""
        return False

    def fell_back(self) -> None:
        """Called after the robot has returned to the slots of the start."""
        return

    def wants_control(self, schedule: SlottedBroadcast, local_ns: int) -> bool:
        """Return whether the robot has to send in its next control sub-slot."""
        return False

    def control_frame(self, schedule: SlottedBroadcast, local_ns: int) -> bytes | None:
        """Return the frame to send in the control sub-slot that begins now; None: send nothing."""
        return None

    def adoption_ns(self, schedule: SlottedBroadcast, local_ns: int) -> int | None:
        """Return the end of a round at which the robot has to call `adopt`; None if none is known yet."""

    def adopt(self, at_ns: int) -> Floats | None:
        """Return the Laplacian that holds from now on; None if the old one stays."""
