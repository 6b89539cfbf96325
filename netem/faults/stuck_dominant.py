"""A CAN bus is dominant over a window, so that no frame gets through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from netem.faults import Fault, Target, World
from netem.faults.schedule import Occurrence


@dataclass(frozen=True)
class StuckDominant(Fault):
    """A frame that is under way at its start is destroyed, and sent again after the end."""

    on: ClassVar = "media"
    strikes: ClassVar = "bus"
    needs: ClassVar = "a CAN bus with two nodes or more"

    def strike(self, world: World, cause: str, targets: Sequence[Target], occurrence: Occurrence) -> None:
        for target in targets:
            world.on_medium(target, "held dominant", cause, {}, occurrence)
