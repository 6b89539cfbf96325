"""A node's clock is set forward or back, as by NTP, without the program's knowledge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

from netem.faults import Fault, Site, Target, World
from netem.faults.candidates import Candidate, ShareOfLength
from netem.faults.schedule import Occurrence


@dataclass(frozen=True)
class ClockStep(Fault):
    """Adds `by_ns` to the reading. A timer that is armed rings when it was going to, or later if it is set back."""

    by_ns: int
    lasting: ClassVar = False

    def __post_init__(self) -> None:
        if self.by_ns == 0:
            raise ValueError("by_ns=0: a step changes the clock")

    @classmethod
    def candidates(cls, site: Site) -> list[Candidate]:
        return [Candidate(on, {"by_ns": ShareOfLength(1 / 20, signed=True)}) for on in cls.targets(site)]

    def strike(self, world: World, cause: str, targets: Sequence[Target], occurrence: Occurrence) -> None:
        for node, in targets:
            world.at(occurrence.start_ns, partial(world.in_node, node, "clock_step", {"by_ns": self.by_ns}))
