"""Links are cut: no frame copy passes that enters them or would arrive within the window."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from netem.faults import Fault, Target, World
from netem.faults.schedule import Occurrence


@dataclass(frozen=True)
class LinkDown(Fault):
    """`spares_under_way` lets copies pass that have entered the link before: so do faults that were injected."""

    on: ClassVar = "links"
    needs: ClassVar = "a medium with two nodes or more"
    cuts: ClassVar = True
    spares_under_way: bool = False

    def strike(self, world: World, cause: str, targets: Sequence[Target], occurrence: Occurrence) -> None:
        for medium, sender, receiver in targets:
            world.cut((medium, sender, receiver), cause, self.spares_under_way).add(*occurrence)
