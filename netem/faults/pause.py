"""A node's processor stands still while the world goes on, as under a debugger or a stalled scheduler.

What arrives waits in a receive buffer of `buffer_frames` for each medium, and the program gets it at the end; a copy
that finds the buffer full ends as "receiver paused". Timers that were due ring at the end, in their order. The plant
goes on with the inputs that it has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

from netem.faults import Fault, Target, World
from netem.faults.schedule import Occurrence


@dataclass(frozen=True)
class Pause(Fault):
    away: ClassVar = True
    buffer_frames: int = 16

    def __post_init__(self) -> None:
        if self.buffer_frames < 0:
            raise ValueError(f"buffer_frames={self.buffer_frames}: expected 0 or more")

    def strike(self, world: World, cause: str, targets: Sequence[Target], occurrence: Occurrence) -> None:
        for node, in targets:
            world.at(occurrence.start_ns,
                     partial(world.pause, node, occurrence.end_ns, self.buffer_frames, cause))
