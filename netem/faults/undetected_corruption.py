"""Frames are changed on the way in spite of their checksum, as by a fault of memory behind the radio's check.

A copy that enters the link within the window gets `flipped_bits` flipped, each drawn from all bits of the frame, with
the probability `ratio`; its checksum finds nothing, so it reaches the program as "delivered corrupt".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from netem.faults import Fault, Target, World
from netem.faults.schedule import Occurrence


@dataclass(frozen=True)
class UndetectedCorruption(Fault):
    """`spares_under_way` leaves copies as they are that their medium has passed to the link before the window."""

    on: ClassVar = "links"
    needs: ClassVar = "a medium with two nodes or more"
    flips: ClassVar = True
    ratio: float = 1.0
    flipped_bits: int = 1
    spares_under_way: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.ratio <= 1:
            raise ValueError(f"ratio={self.ratio}: expected 0 < ratio <= 1")
        if self.flipped_bits < 1:
            raise ValueError(f"flipped_bits={self.flipped_bits}: expected at least 1")

    def strike(self, world: World, cause: str, targets: Sequence[Target], occurrence: Occurrence) -> None:
        for medium, sender, receiver in targets:
            world.flip((medium, sender, receiver), cause, self.ratio, self.flipped_bits,
                       self.spares_under_way).add(*occurrence)
