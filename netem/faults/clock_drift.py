"""A node's clock runs faster or slower for a while, as an oscillator does that warms up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

from netem.faults import Fault, Site, Target, World
from netem.faults.candidates import Between, Candidate
from netem.faults.schedule import Occurrence
from netem.wire.instants import NEVER_NS

MOST_DRAWN_PPM: Final = 1000.0


@dataclass(frozen=True)
class ClockDrift(Fault):
    """Adds `by_ppm` to the drift, and takes it away at the end."""

    by_ppm: float

    def __post_init__(self) -> None:
        if not -1e6 < self.by_ppm < 1e6 or self.by_ppm == 0:
            raise ValueError(f"by_ppm={self.by_ppm}: expected -1e6 < by_ppm < 1e6 and not 0")

    @classmethod
    def candidates(cls, site: Site) -> list[Candidate]:
        return [Candidate(on, {"by_ppm": Between(0.0, MOST_DRAWN_PPM, signed=True)}) for on in cls.targets(site)]

    def strike(self, world: World, cause: str, targets: Sequence[Target], occurrence: Occurrence) -> None:
        for node, in targets:
            world.at(occurrence.start_ns, partial(world.in_node, node, "clock_drift", {"by_ppm": self.by_ppm}))
            if occurrence.end_ns < NEVER_NS:
                world.at(occurrence.end_ns, partial(world.in_node, node, "clock_drift", {"by_ppm": -self.by_ppm}))
