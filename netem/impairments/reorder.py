"""Reordering: chosen copies pass at once, all others are held for `hold_ns` and overtaken (`tc netem reorder`).

After a chosen copy the next `gap_frames - 1` are held; each one after them is chosen with probability `reorder_ratio`,
until one is. The share of chosen copies in the long run is 1 / (gap_frames - 1 + 1/reorder_ratio).
A chosen copy overtakes the held ones that entered the link less than `hold_ns` before it. No other copy overtakes any:
one that enters after the end of a time window leaves after the last held one.

Not modelled: displacement by a number of frames. For a random hold use `delay` with jitter instead.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from random import Random
from typing import ClassVar

from msgspec.structs import replace

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment
from netem.impairments.checks import expect_at_least, expect_ratio
from netem.impairments.correlated_uniforms import correlated_uniforms
from netem.impairments.flow import Flow
from netem.impairments.order import not_before


@dataclass
class Reorder(Impairment):
    loses_as: ClassVar[Fate] = Fate.LOST
    only_delays: ClassVar[bool] = True

    hold_ns: int                            # > 0
    reorder_ratio: float = 1.0              # 0 <= reorder_ratio <= 1
    gap_frames: int = 1                     # >= 1
    correlation: float = 0.0                # rank correlation of successive draws, in (-1, 1)
    rng: Random = field(kw_only=True)
    held: int = field(default=0, init=False)        # copies held since the last chosen one

    def __post_init__(self) -> None:
        expect_at_least("hold_ns", self.hold_ns, 1)
        expect_at_least("gap_frames", self.gap_frames, 1)
        expect_ratio("reorder_ratio", self.reorder_ratio)
        if self.reorder_ratio == 1 and self.gap_frames == 1:
            raise ValueError("reorder_ratio=1.0, gap_frames=1: every copy would pass at once and none overtake: "
                             "lower reorder_ratio or raise gap_frames")
        self._draw = correlated_uniforms(self.rng, self.correlation)
        self._latest_ns = 0             # instant at which the last of the held copies leaves

    def carry(self, transit: Transit) -> Iterator[Transit]:
        if self.held >= self.gap_frames - 1 and self._draw() < self.reorder_ratio:
            self.held = 0
            yield transit
        else:
            self.held += 1
            arrival_ns = transit.arrival_ns + self.hold_ns
            self._latest_ns = max(arrival_ns, self._latest_ns)
            yield replace(transit, arrival_ns=arrival_ns)

    def most_delay_ns(self, flow: Flow) -> int:
        """The hold; after the time window a copy waits for a held one that entered before it, so for less."""
        return self.hold_ns

    def carry_outside(self, transit: Transit) -> Transit:
        """Delay a copy from outside the time window until it overtakes no held one."""
        return not_before(transit, self._latest_ns)
