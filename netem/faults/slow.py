"""A node's processor is slower than usual, as one that is hot or shared: its tasks take longer by a factor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import isfinite
from typing import ClassVar, Final

from netem.faults import Fault, Site, Target, World
from netem.faults.candidates import Between, Candidate
from netem.faults.schedule import Occurrence
from netem.wire.instants import NEVER_NS

MOST_DRAWN_FACTOR: Final = 10.0


@dataclass(frozen=True)
class Slow(Fault):
    """Execution times are multiplied by `factor`; the factors of several faults multiply."""

    needs: ClassVar = "a program that asks board.execution_ns"
    factor: float

    def __post_init__(self) -> None:
        if not (isfinite(self.factor) and self.factor >= 1):
            raise ValueError(f"factor={self.factor}: expected a finite number >= 1: execution times get longer")

    @classmethod
    def candidates(cls, site: Site) -> list[Candidate]:
        return [Candidate(node, {"factor": Between(1.0, MOST_DRAWN_FACTOR)}) for node in site.nodes
                if node in site.timed]

    def refusal(self, target: Target, site: Site) -> str:
        node, = target
        return "" if node in site.timed else (
            f"{node} runs a program without execution times, which nothing can slow down; one that asks "
            "board.execution_ns says so by has_execution_time = True")

    def strike(self, world: World, cause: str, targets: Sequence[Target], occurrence: Occurrence) -> None:
        for node, in targets:
            for time_ns, begins in ((occurrence.start_ns, True), (occurrence.end_ns, False)):
                if time_ns < NEVER_NS:
                    world.at(time_ns, partial(world.in_node, node, "slow", {"factor": self.factor, "begins": begins}))
